// The layers of stacking structures, drawn over pictures as translucent cylinders (and, around a
// line or a polygon, as their counterparts).
#pragma once

#include <vector>

#include "render/overlay.h"
#include "trajectory/pile_layers.h"

namespace pilesim {

class PileOverlay final : public Overlay {
 public:
  // As read_pile_layers().
  explicit PileOverlay(const std::filesystem::path& file);

  void draw(uint64_t index, const TrajectoryFrame& frame, const CameraKey& camera,
            Image& image) const override;

  // The rim of a layer, x and z, m: the core grown by the radius, cut by the walls.
  static std::vector<Eigen::Vector2f> outline(const LayeredPile& pile, float radius_m);

 private:
  std::vector<PileLayersChange> changes_;  // ascending
};

}  // namespace pilesim
