// The surface of a heap of bodies as heights over a grid, and the angle of its slopes.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "geometry/mesh.h"
#include "pile/pile_shape.h"

namespace pilesim {

// Points of a mesh's surface (body frame), about `spacing_m` apart.
std::vector<Vec3> surface_points(const TriangleMesh& mesh, double spacing_m);

class HeightField {
 public:
  // Over the square around `middle`, as heights over `base_m`.
  HeightField(const GroundPoint& middle, double half_width_m, double cell_m, double base_m);

  void add(const std::vector<Vec3>& points, const Pose& pose);

  double cell_m() const { return cell_m_; }
  // Calls use(centre of the cell, height >= 0) for all cells.
  template <class Use>
  void for_each(const Use& use) const {
    for (size_t i = 0; i < height_.size(); ++i) {
      const GroundPoint cell(static_cast<double>(i % width_) + 0.5,
                             static_cast<double>(i / width_) + 0.5);
      use(GroundPoint(corner_ + cell_m_ * cell), height_[i]);
    }
  }

 private:
  GroundPoint corner_;
  double cell_m_, base_m_;
  size_t width_;
  std::vector<double> height_;
};

// Which points of the ground belong to a pile: all inside its walls but those nearer to another's
// foot.
using Territory = std::function<bool(const GroundPoint&)>;

// The reach of the ideal pile that holds as much as lies within that reach; at most
// shape.most_reach().
double reach_of_bulk(const PileShape& shape, const HeightField& field, const Territory& territory);

inline constexpr int kAzimuths = 16;

// Slopes of a pile: one line of height over distance for each azimuth, fitted by the median of
// pairwise slopes (Theil and Sen) to where the pile is between a fifth and nine tenths of its
// height. Where cones have run together, over the azimuths of all. Azimuths in which a neighbouring
// pile takes more than a quarter of that are left out: a cone has no slope of its own there.
struct SlopeFit {
  double angle = 0;   // rad, median over azimuths
  double spread = 0;  // rad, half of the range of the middle two thirds of them
  int azimuths = 0;   // free and with enough flank to be fitted; 0: there is no slope
};
// Of the azimuths that can be fitted; rad.
std::vector<double> slope_angles(const PileShape& shape, const HeightField& field,
                                 const Territory& territory);
SlopeFit fit_slope(std::vector<double> angles);

}  // namespace pilesim
