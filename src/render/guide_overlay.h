// A guide, translucent over the pile in it, black dots where bodies are held, and glue as lines as
// thick as it is strong.
#pragma once

#include <vector>

#include "render/overlay.h"
#include "trajectory/guide_file.h"

namespace pilesim {

class GuideOverlay final : public Overlay {
 public:
  // As read_guide_file().
  explicit GuideOverlay(const std::filesystem::path& file);

  void draw(uint64_t index, const TrajectoryFrame& frame, const CameraKey& camera,
            Image& image) const override;

 private:
  void draw_guide(const CameraKey& camera, Image& image) const;

  GuideFile guide_;
};

}  // namespace pilesim
