// The forces with which the analysis of a glued pile found it to stand, as chains of lines from
// body to body: dark blue where two push each other apart, red where glue draws them together.
#pragma once

#include "render/overlay.h"
#include "trajectory/guide_file.h"

namespace pilesim {

class ForcesOverlay final : public Overlay {
 public:
  // As read_guide_file(); Error(input) where there are none.
  explicit ForcesOverlay(const std::filesystem::path& file);

  void draw(uint64_t index, const TrajectoryFrame& frame, const CameraKey& camera,
            Image& image) const override;

 private:
  GuideFile guide_;  // forces: the strongest last, above all others
};

}  // namespace pilesim
