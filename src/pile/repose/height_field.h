// The surface of a heap of bodies as heights over a grid, and the angle of its slopes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "geometry/mesh.h"
#include "pile/repose/pile_shape.h"

namespace pilesim {

// Points of a mesh's surface (body frame), about `spacing_m` apart.
std::vector<Vec3> surface_points(const TriangleMesh& mesh, double spacing_m);

// The part of a body over one cell of the grid on the ground, whose corner (0, 0) is the origin.
struct Column {
  int32_t x = 0, z = 0;  // cell
  double top_m = 0;      // highest point over the cell, world
};
std::vector<Column> columns_of(const std::vector<Vec3>& points, const Pose& pose, double cell_m);

using GroundBox = Eigen::AlignedBox2d;

class HeightField {
 public:
  // All cells that intersect `area`, as heights over `base_m`.
  HeightField(const GroundBox& area, double cell_m, double base_m);

  void add(const std::vector<Column>& columns);

  double cell_m() const { return cell_m_; }
  // Calls use(centre of the cell, height >= 0) for all cells.
  template <class Use>
  void for_each(const Use& use) const {
    for (size_t i = 0; i < height_.size(); ++i) {
      const auto column = static_cast<int32_t>(i % width_), row = static_cast<int32_t>(i / width_);
      use(GroundPoint((first_x_ + column + 0.5) * cell_m_, (first_z_ + row + 0.5) * cell_m_),
          height_[i]);
    }
  }

 private:
  double cell_m_, base_m_;
  int32_t first_x_, first_z_;
  size_t width_, depth_;
  std::vector<double> height_;
};

// True for points of the ground that belong to a pile: inside its walls, and not nearer to another
// pile's foot.
using Territory = std::function<bool(const GroundPoint&)>;

// A cell of a pile's territory.
struct SurfaceCell {
  double distance_m = 0;  // of its centre from the pile's core
  double height_m = 0;    // of the bodies over the base
  double round = 0;       // position round the core, as PileShape::way_round()
  double weight = 1;      // its weight in the surface
};

// The reach of the ideal pile that holds the volume within that reach, to an eighth of a cell; at
// most shape.most_reach().
double reach_of_bulk(const PileShape& shape, const std::vector<SurfaceCell>& cells, double cell_m);

inline constexpr int kAzimuths = 16;

// Slopes of a pile: a line of height over distance for each of several equal parts of its
// circumference (azimuths for a cone). A median of pairwise slopes (Theil and Sen) fits the line
// between a fifth and nine tenths of the height of a straight slope of the same volume. For merged
// cones, over the parts of all. Parts are left out if a neighbouring pile takes more than a
// twentieth of the flank: there the slope does not fall away from the cone's middle.
struct SlopeFit {
  double angle = 0;   // rad, median over the azimuths
  double spread = 0;  // rad, half the range of the middle two thirds of them
  int azimuths = 0;   // number with a free flank long enough for a fit; 0: there is no slope

  static void fields(auto& self, auto& stream) { stream(self.angle, self.spread, self.azimuths); }
};
// Slopes of the azimuths that can be fitted, rad.
std::vector<double> slope_angles(const PileShape& shape, const HeightField& field,
                                 const Territory& territory);
SlopeFit fit_slope(std::vector<double> angles);

}  // namespace pilesim
