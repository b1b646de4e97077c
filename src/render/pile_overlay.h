// The layers of stacking structures, drawn over pictures as translucent cylinders (and, around a
// line or a polygon, as their counterparts).
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "core/types.h"
#include "render/scene_renderer.h"

namespace pilesim {

class PileOverlay {
 public:
  // Reads the piles.json of `pilesim direct-pile`. Throws Error(io), or Error(input) where it is
  // not one.
  explicit PileOverlay(const std::filesystem::path& file);

  // The layers as of a frame of the trajectory. They are drawn over what stands before them, too.
  void draw(uint64_t frame, const CameraKey& camera, Image& image) const;

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
