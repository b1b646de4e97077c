#include "geometry/self_touching.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/parallel_for.h"
#include "geometry/triangle_tree.h"

namespace pilesim {
namespace {

// Folds of less than this angle are flat, rad. A real blade is blunter.
constexpr double kFlatFold = 1e-7;

struct Interval {
  double low, high;
};

Interval projected(const Corners& corners, const Vec3& axis) {
  const double a = corners[0].dot(axis), b = corners[1].dot(axis), c = corners[2].dot(axis);
  return {std::min({a, b, c}), std::max({a, b, c})};
}

std::array<Vec3, 3> unit_edges(const Corners& corners) {
  return {(corners[1] - corners[0]).normalized(), (corners[2] - corners[1]).normalized(),
          (corners[0] - corners[2]).normalized()};
}

// Is there a plane with one triangle on either side, more than `tolerance` apart? Separating axis
// test: two convex polygons are apart along a normal of one of them, along a product of two of
// their edges or, in one plane, across an edge. A plane that is found is a proof; only pairs nearly
// touching are left without one.
bool are_apart(const Corners& a, const Corners& b, double tolerance) {
  // Seen from one of the corners, so that projections keep their digits.
  const Corners near_a{Vec3::Zero(), a[1] - a[0], a[2] - a[0]};
  const Corners near_b{b[0] - a[0], b[1] - a[0], b[2] - a[0]};
  const auto separates = [&](const Vec3& axis) {
    const double length = axis.norm();
    if (length < 1e-9) return false;  // of unit vectors nearly parallel: no direction
    const Interval on_a = projected(near_a, axis), on_b = projected(near_b, axis);
    return std::max(on_a.low - on_b.high, on_b.low - on_a.high) > tolerance * length;
  };
  const std::array<Vec3, 3> edges_a = unit_edges(near_a), edges_b = unit_edges(near_b);
  const Vec3 normal_a = near_a[1].cross(near_a[2]).normalized();
  const Vec3 normal_b = (near_b[1] - near_b[0]).cross(near_b[2] - near_b[0]).normalized();
  if (separates(normal_a) || separates(normal_b)) return true;
  for (const Vec3& edge : edges_a) {
    if (separates(normal_a.cross(edge))) return true;
  }
  for (const Vec3& edge : edges_b) {
    if (separates(normal_b.cross(edge))) return true;
  }
  for (const Vec3& edge_a : edges_a) {
    for (const Vec3& edge_b : edges_b) {
      if (separates(edge_a.cross(edge_b))) return true;
    }
  }
  return false;
}

double volume(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  return (b - a).cross(c - a).dot(d - a);
}

// Does the segment go through the inside of the triangle? Decided only where it is clear: all five
// volumes must be larger than the rounding in a mesh of this size.
bool pierces(const Vec3& from, const Vec3& to, const Corners& corners, double noise) {
  const auto& [a, b, c] = corners;
  const double at_from = volume(a, b, c, from), at_to = volume(a, b, c, to);
  if (std::min(std::abs(at_from), std::abs(at_to)) <= noise || at_from * at_to > 0) return false;
  const double ab = volume(from, to, a, b), bc = volume(from, to, b, c);
  const double ca = volume(from, to, c, a);
  return std::min({ab, bc, ca}) > noise || std::max({ab, bc, ca}) < -noise;
}

// Corners that two triangles share, as positions 0 to 2 in each.
struct Shared {
  int count = 0;
  std::array<size_t, 3> in_a{}, in_b{};
};

Shared shared_corners(const Triangle& a, const Triangle& b) {
  Shared shared;
  for (size_t i = 0; i < 3; ++i) {
    for (size_t k = 0; k < 3; ++k) {
      if (a[i] != b[k]) continue;
      shared.in_a[static_cast<size_t>(shared.count)] = i;
      shared.in_b[static_cast<size_t>(shared.count++)] = k;
      break;
    }
  }
  return shared;
}

// Both triangles lie on the same side of the edge they share, in one plane.
bool folded_flat(const Corners& a, const Corners& b, const Shared& shared) {
  const Vec3& origin = a[shared.in_a[0]];
  const Vec3 edge = (a[shared.in_a[1]] - origin).normalized();
  const auto across = [&](const Vec3& corner) {
    const Vec3 arm = corner - origin;
    return (arm - arm.dot(edge) * edge).normalized();
  };
  const Vec3 arm_a = across(a[3 - shared.in_a[0] - shared.in_a[1]]);
  const Vec3 arm_b = across(b[3 - shared.in_b[0] - shared.in_b[1]]);
  return (arm_a - arm_b).norm() < kFlatFold;
}

class TouchSearch {
 public:
  explicit TouchSearch(const TriangleMesh& mesh) : mesh_(mesh), tree_(mesh) {
    const double diagonal = tree_.nodes()[0].box.diagonal().norm();
    tolerance_ = 1e-12 * diagonal;
    noise_ = 1e-15 * diagonal * diagonal * diagonal;
  }

  TouchingTriangles run() const {
    constexpr size_t kGrain = 1024;
    const size_t count = mesh_.triangles.size();
    std::vector<TouchingTriangles> chunks((count + kGrain - 1) / kGrain);
    parallel_for(count, kGrain, [&](size_t begin, size_t end) {
      TouchingTriangles& found = chunks[begin / kGrain];
      for (size_t i = begin; i < end; ++i) search(static_cast<uint32_t>(i), found);
      sort_once(found.triangles);
    });
    TouchingTriangles all;
    for (const TouchingTriangles& chunk : chunks) merge(chunk, all);
    sort_once(all.triangles);
    return all;
  }

 private:
  static void merge(const TouchingTriangles& more, TouchingTriangles& all) {
    if (more.count == 0) return;
    all.first = all.count == 0 ? more.first : std::min(all.first, more.first);
    all.count += more.count;
    all.triangles.insert(all.triangles.end(), more.triangles.begin(), more.triangles.end());
  }

  static void sort_once(std::vector<uint32_t>& triangles) {
    std::ranges::sort(triangles);
    triangles.erase(std::unique(triangles.begin(), triangles.end()), triangles.end());
  }

  // Pairs of the triangle at `i` in tree order with those behind it.
  void search(uint32_t i, TouchingTriangles& found) const {
    Bounds box;
    for (const Vec3& corner : tree_.corners()[i]) box.extend(corner);
    tree_.for_each_near(box, i + 1, [&](uint32_t k) {
      if (!touch(i, k)) return;
      const auto pair = std::minmax(tree_.triangles()[i], tree_.triangles()[k]);
      merge({.count = 1, .first = pair, .triangles = {pair.first, pair.second}}, found);
    });
  }

  bool touch(uint32_t i, uint32_t k) const {
    const Corners &a = tree_.corners()[i], &b = tree_.corners()[k];
    const Shared shared = shared_corners(mesh_.triangles[tree_.triangles()[i]],
                                         mesh_.triangles[tree_.triangles()[k]]);
    if (shared.count == 0) return !are_apart(a, b, tolerance_);
    if (shared.count == 1) {
      const size_t in_a = shared.in_a[0], in_b = shared.in_b[0];
      return pierces(a[(in_a + 1) % 3], a[(in_a + 2) % 3], b, noise_) ||
             pierces(b[(in_b + 1) % 3], b[(in_b + 2) % 3], a, noise_);
    }
    return shared.count == 3 || folded_flat(a, b, shared);
  }

  const TriangleMesh& mesh_;
  TriangleTree tree_;
  double tolerance_;  // m
  double noise_;      // m^3, six times the volume of a tetrahedron that may be flat
};

}  // namespace

TouchingTriangles find_touching_triangles(const TriangleMesh& mesh) {
  return TouchSearch(mesh).run();
}

}  // namespace pilesim
