#include "geometry/triangle_tree.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numeric>

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

TriangleTree::TriangleTree(const TriangleMesh& mesh, uint32_t leaf_size)
    : triangles_(mesh.triangles.size()) {
  assert(!mesh.triangles.empty() && leaf_size > 0);
  std::iota(triangles_.begin(), triangles_.end(), 0u);
  std::vector<Vec3> centroids;
  centroids.reserve(triangles_.size());
  for (const auto& [a, b, c] : mesh.triangles) {
    centroids.push_back((mesh.vertices[a] + mesh.vertices[b] + mesh.vertices[c]) / 3.0);
  }
  build(centroids, 0, static_cast<uint32_t>(triangles_.size()), leaf_size);

  corners_.reserve(triangles_.size());
  for (const uint32_t index : triangles_) {
    const auto& [a, b, c] = mesh.triangles[index];
    corners_.push_back({mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]});
  }
  after_.resize(nodes_.size());
  for (size_t i = nodes_.size(); i-- > 0;) {  // children lie behind their parents
    Node& node = nodes_[i];
    if (node.is_leaf()) {
      for (uint32_t k = node.first; k < node.first + node.count; ++k) {
        for (const Vec3& corner : corners_[k]) node.box.extend(corner);
      }
      after_[i] = static_cast<uint32_t>(i) + 1;
    } else {
      node.box = nodes_[i + 1].box.merged(nodes_[node.right].box);
      after_[i] = after_[node.right];
    }
  }
}

void TriangleTree::build(const std::vector<Vec3>& centroids, uint32_t first, uint32_t count,
                         uint32_t leaf_size) {
  const auto index = static_cast<uint32_t>(nodes_.size());
  nodes_.push_back({.box = {}, .first = first, .count = count, .right = 0});
  if (count <= leaf_size) return;

  Bounds spread;
  const auto begin = triangles_.begin() + first;
  std::for_each(begin, begin + count, [&](uint32_t i) { spread.extend(centroids[i]); });
  Eigen::Index axis;
  spread.sizes().maxCoeff(&axis);
  const uint32_t half = count / 2;
  std::nth_element(begin, begin + half, begin + count, [&](uint32_t i, uint32_t j) {
    const double a = centroids[i](axis), b = centroids[j](axis);
    return a != b ? a < b : i < j;
  });
  build(centroids, first, half, leaf_size);
  nodes_[index].right = static_cast<uint32_t>(nodes_.size());
  build(centroids, first + half, count - half, leaf_size);
}

double TriangleTree::distance(const Vec3& point) const {
  double best = std::numeric_limits<double>::infinity();  // squared, m^2
  struct Pending {
    uint32_t index;
    double distance;  // of its box, squared, m^2
  };
  std::array<Pending, 128> stack;  // deeper than any tree of 2^32 triangles needs
  size_t size = 0;
  stack[size++] = {0, nodes_[0].box.squaredExteriorDistance(point)};
  while (size > 0) {
    const auto [index, box_distance] = stack[--size];
    if (box_distance >= best) continue;
    const Node& node = nodes_[index];
    if (node.is_leaf()) {
      for (uint32_t i = node.first; i < node.first + node.count; ++i) {
        best = std::min(best, (closest_point(corners_[i], point) - point).squaredNorm());
      }
      continue;
    }
    Pending near{index + 1, nodes_[index + 1].box.squaredExteriorDistance(point)};
    Pending far{node.right, nodes_[node.right].box.squaredExteriorDistance(point)};
    if (far.distance < near.distance) std::swap(near, far);
    stack[size++] = far;
    stack[size++] = near;
  }
  return std::sqrt(best);
}

}  // namespace pilesim
