// Bounding-box tree over the triangles of a mesh, for spatial searches.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "core/types.h"
#include "geometry/box_tree.h"
#include "geometry/mesh.h"

namespace pilesim {

using Corners = std::array<Vec3, 3>;  // of a triangle, counter-clockwise from outside

// The point of a triangle that is closest to `point`.
Vec3 closest_point(const Corners& corners, const Vec3& point);

class TriangleTree {
 public:
  using Node = BoxTree::Node;

  // `mesh` has triangles. Leaves hold at most `leaf_size` of them.
  explicit TriangleTree(const TriangleMesh& mesh, uint32_t leaf_size = 4);

  const std::vector<Node>& nodes() const { return boxes_.nodes(); }  // the root first
  // In tree order: the corners of each triangle and its index in the mesh.
  const std::vector<Corners>& corners() const { return corners_; }
  const std::vector<uint32_t>& triangles() const { return boxes_.items(); }

  // Distance from `point` to the surface, m; the sooner found the better it is known to be below
  // `at_most_m`.
  double distance(const Vec3& point,
                  double at_most_m = std::numeric_limits<double>::infinity()) const;

  // As BoxTree's: visit(i) for places in corners(), in tree order.
  template <typename Visit>
  void for_each_near(const Bounds& box, uint32_t first, const Visit& visit) const {
    boxes_.for_each_near(box, first, visit);
  }

 private:
  BoxTree boxes_;
  std::vector<Corners> corners_;
};

}  // namespace pilesim
