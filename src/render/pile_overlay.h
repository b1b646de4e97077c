// The layers of stacking structures, drawn over pictures as translucent cylinders (and, around a
// line or a polygon, as their counterparts).
#pragma once

#include <vector>

#include "render/overlay.h"

namespace pilesim {

class PileOverlay final : public Overlay {
 public:
  // Reads the piles.json of `pilesim direct-pile`. Throws Error(io), or Error(input) where it is
  // not one.
  explicit PileOverlay(const std::filesystem::path& file);

  void draw(uint64_t frame, const CameraKey& camera, Image& image) const override;

 private:
  struct Layer {
    float bottom_m, top_m, radius_m;
  };
  struct Pile {
    std::vector<Eigen::Vector2f> core, walls;  // x, z; convex, turning left; no walls: empty
    std::vector<Layer> layers;
  };
  struct Change {
    uint64_t frame;
    std::vector<Pile> piles;
  };

  static std::vector<Eigen::Vector2f> outline(const Pile& pile, float radius_m);

  std::vector<Change> changes_;  // ascending
};

}  // namespace pilesim
