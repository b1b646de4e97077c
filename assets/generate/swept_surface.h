// Closed surfaces swept out by polygons.
#pragma once

#include <vector>

#include "core/types.h"
#include "geometry/mesh.h"

namespace pilesim {

// One closed polygon of a surface; all rings of a surface have the same number of points.
using Ring = std::vector<Vec3>;

// Joins rings in order and closes the first and the last, which must be convex. Rings run
// counter-clockwise seen from the last one.
TriangleMesh loft(const std::vector<Ring>& rings);

// Joins rings in order and the last to the first: a torus.
TriangleMesh closed_loft(const std::vector<Ring>& rings);

// Points (x, y) of the plane z = 0 and convex cells of them, counter-clockwise; cells that meet
// share whole edges.
struct PlaneCells {
  std::vector<Eigen::Vector2d> points;
  std::vector<std::vector<uint32_t>> cells;

  // Adds a cell; points closer than 1e-9 m to earlier ones are shared.
  void add(const std::vector<Eigen::Vector2d>& corners);
};

// The solid over `cells` from z = -depth / 2 to depth / 2.
TriangleMesh extrude(const PlaneCells& cells, double depth);

}  // namespace pilesim
