#include "geometry/triangle_tree.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace pilesim {

Vec3 closest_point(const Corners& corners, const Vec3& point) {
  const auto& [a, b, c] = corners;
  const Vec3 ab = b - a, ac = c - a;
  const Vec3 normal = ab.cross(ac);
  const double area_squared = normal.squaredNorm();
  if (area_squared > 0) {
    // Barycentric coordinates of the point's projection onto the plane.
    const double at_b = (point - a).cross(ac).dot(normal);
    const double at_c = ab.cross(point - a).dot(normal);
    if (at_b >= 0 && at_c >= 0 && at_b + at_c <= area_squared) {
      return a + (at_b * ab + at_c * ac) / area_squared;
    }
  }
  const auto on_segment = [&](const Vec3& from, const Vec3& to) -> Vec3 {
    const Vec3 along = to - from;
    const double length_squared = along.squaredNorm();
    if (length_squared == 0) return from;
    return from + std::clamp((point - from).dot(along) / length_squared, 0.0, 1.0) * along;
  };
  Vec3 closest = on_segment(a, b);
  for (const Vec3& candidate : {on_segment(b, c), on_segment(c, a)}) {
    if ((candidate - point).squaredNorm() < (closest - point).squaredNorm()) closest = candidate;
  }
  return closest;
}

namespace {

BoxTree tree_of(const TriangleMesh& mesh, uint32_t leaf_size) {
  assert(!mesh.triangles.empty());
  std::vector<Bounds> boxes;
  std::vector<Vec3> centroids;
  boxes.reserve(mesh.triangles.size());
  centroids.reserve(mesh.triangles.size());
  for (const auto& triangle : mesh.triangles) {
    Bounds& box = boxes.emplace_back();
    for (const uint32_t vertex : triangle) box.extend(mesh.vertices[vertex]);
    const auto& [a, b, c] = triangle;
    centroids.push_back((mesh.vertices[a] + mesh.vertices[b] + mesh.vertices[c]) / 3.0);
  }
  return BoxTree(boxes, centroids, leaf_size);
}

}  // namespace

TriangleTree::TriangleTree(const TriangleMesh& mesh, uint32_t leaf_size)
    : boxes_(tree_of(mesh, leaf_size)) {
  corners_.reserve(mesh.triangles.size());
  for (const uint32_t index : boxes_.items()) {
    const auto& [a, b, c] = mesh.triangles[index];
    corners_.push_back({mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]});
  }
}

double TriangleTree::distance(const Vec3& point, double at_most_m) const {
  const std::vector<Node>& nodes = this->nodes();
  double best = at_most_m * at_most_m;  // squared, m^2
  struct Pending {
    uint32_t index;
    double distance;  // of its box, squared, m^2
  };
  std::array<Pending, 128> stack;  // deeper than any tree of 2^32 triangles needs
  size_t size = 0;
  stack[size++] = {0, nodes[0].box.squaredExteriorDistance(point)};
  while (size > 0) {
    const auto [index, box_distance] = stack[--size];
    if (box_distance >= best) continue;
    const Node& node = nodes[index];
    if (node.is_leaf()) {
      for (uint32_t i = node.first; i < node.first + node.count; ++i) {
        best = std::min(best, (closest_point(corners_[i], point) - point).squaredNorm());
      }
      continue;
    }
    Pending near{index + 1, nodes[index + 1].box.squaredExteriorDistance(point)};
    Pending far{node.right, nodes[node.right].box.squaredExteriorDistance(point)};
    if (far.distance < near.distance) std::swap(near, far);
    stack[size++] = far;
    stack[size++] = near;
  }
  return std::sqrt(best);
}

}  // namespace pilesim
