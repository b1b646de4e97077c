// Bounding-box tree over the triangles of a mesh, for spatial searches.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "core/types.h"
#include "geometry/mesh.h"

namespace pilesim {

using Corners = std::array<Vec3, 3>;  // of a triangle, counter-clockwise from outside

// The point of a triangle that is closest to `point`.
Vec3 closest_point(const Corners& corners, const Vec3& point);

class TriangleTree {
 public:
  // Nodes lie depth first: the left child follows its parent. A leaf has no right child.
  struct Node {
    Bounds box;
    uint32_t first;  // of the triangles below, in tree order
    uint32_t count;
    uint32_t right;  // index of the right child; 0: a leaf
    bool is_leaf() const { return right == 0; }
  };

  // `mesh` has triangles. Leaves hold at most `leaf_size` of them.
  explicit TriangleTree(const TriangleMesh& mesh, uint32_t leaf_size = 4);

  const std::vector<Node>& nodes() const { return nodes_; }  // the root first
  // In tree order: the corners of each triangle and its index in the mesh.
  const std::vector<Corners>& corners() const { return corners_; }
  const std::vector<uint32_t>& triangles() const { return triangles_; }

  // Distance from `point` to the surface, m.
  double distance(const Vec3& point) const;

  // Calls visit(i), in tree order, for the triangles from `first` on of all leaves whose box meets
  // `box`, borders included: for each triangle that meets it, and some nearby.
  template <typename Visit>
  void for_each_near(const Bounds& box, uint32_t first, const Visit& visit) const {
    for (uint32_t index = 0; index < nodes_.size();) {
      const Node& node = nodes_[index];
      const uint32_t end = node.first + node.count;
      if (end <= first || !node.box.intersects(box)) {
        index = after_[index];
        continue;
      }
      if (node.is_leaf()) {
        for (uint32_t i = std::max(first, node.first); i < end; ++i) visit(i);
      }
      ++index;
    }
  }

 private:
  void build(const std::vector<Vec3>& centroids, uint32_t first, uint32_t count,
             uint32_t leaf_size);

  std::vector<Node> nodes_;
  std::vector<uint32_t> after_;  // per node: index of the node behind all that lie below it
  std::vector<Corners> corners_;
  std::vector<uint32_t> triangles_;
};

}  // namespace pilesim
