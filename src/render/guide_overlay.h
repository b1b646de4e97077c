// A guide, translucent over the pile in it, and black dots where bodies are held.
#pragma once

#include <vector>

#include "render/overlay.h"

namespace pilesim {

class GuideOverlay final : public Overlay {
 public:
  // Reads a guide.json. Throws Error(io), or Error(input) where it is not one.
  explicit GuideOverlay(const std::filesystem::path& file);

  void draw(uint64_t frame, const CameraKey& camera, Image& image) const override;

 private:
  struct Change {
    uint64_t frame;
    std::vector<Vec3f> points;
  };

  void draw_guide(const CameraKey& camera, Image& image) const;

  std::vector<Vec3f> vertices_;  // m, world; empty: no mesh
  std::vector<Eigen::Vector3i> triangles_;
  std::vector<Change> changes_;  // ascending
};

}  // namespace pilesim
