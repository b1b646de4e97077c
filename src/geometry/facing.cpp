#include "geometry/facing.h"

#include <algorithm>
#include <utility>

#include "geometry/half_edges.h"
#include "geometry/inside_test.h"

namespace pilesim {
namespace {

// Just outside of a surface, in diagonals of the mesh.
constexpr double kJustOutside = 1e-7;

double area_of(const TriangleMesh& mesh, uint32_t i) {
  const auto& [a, b, c] = mesh.triangles[i];
  const Vec3& corner = mesh.vertices[a];
  return (mesh.vertices[b] - corner).cross(mesh.vertices[c] - corner).norm() / 2;
}

bool are_closed(const TriangleMesh& mesh) {
  bool closed = true;
  const HalfEdges sides(mesh.triangles, mesh.vertices.size());
  sides.for_each_edge([&](std::span<const HalfEdge> edge) { closed &= edge.size() == 2; });
  return closed;
}

class PatchTurner {
 public:
  PatchTurner(TriangleMesh& mesh, const Patches& patches, const Bounds& bounds)
      : mesh_(mesh), patch_(patches.of_triangle), count_(patches.count), bounds_(bounds) {}

  TurnedPatches run() {
    const std::vector<uint8_t> was_inward = inward();
    turn(was_inward);
    std::vector<uint8_t> is_hollow(count_, 0), is_inside(count_, 0);
    if (count_ > 1) {
      const InsideTest inside({.vertices = mesh_.vertices, .triangles = mesh_.triangles});
      const std::vector<Vec3> outside = points_outside();
      for (uint32_t p = 0; p < count_; ++p) {
        if (inside.winding_number(outside[p]) < 0.5) continue;
        (was_inward[p] ? is_hollow : is_inside)[p] = 1;
      }
    }
    turn(is_hollow);
    TurnedPatches turned;
    for (uint32_t p = 0; p < count_; ++p) turned.inward += was_inward[p] && !is_hollow[p];
    turned.dropped = drop(is_inside);
    return turned;
  }

 private:
  void turn(const std::vector<uint8_t>& is_to_turn) {
    for (size_t i = 0; i < mesh_.triangles.size(); ++i) {
      if (is_to_turn[patch_[i]]) std::swap(mesh_.triangles[i][1], mesh_.triangles[i][2]);
    }
  }

  // Whether the volume is negative, by patch.
  std::vector<uint8_t> inward() const {
    const Vec3 middle = bounds_.center();
    std::vector<double> volume(count_, 0);
    for (size_t i = 0; i < mesh_.triangles.size(); ++i) {
      const Triangle& t = mesh_.triangles[i];
      const Vec3 a = mesh_.vertices[t[0]] - middle, b = mesh_.vertices[t[1]] - middle;
      volume[patch_[i]] += a.dot(b.cross(mesh_.vertices[t[2]] - middle)) / 6;
    }
    std::vector<uint8_t> inward(count_);
    for (uint32_t p = 0; p < count_; ++p) inward[p] = volume[p] < 0;
    return inward;
  }

  // By patch, a point just outside of its largest triangle.
  std::vector<Vec3> points_outside() const {
    std::vector<uint32_t> largest(count_, UINT32_MAX);
    for (uint32_t i = 0; i < mesh_.triangles.size(); ++i) {
      uint32_t& best = largest[patch_[i]];
      if (best == UINT32_MAX || area_of(mesh_, i) > area_of(mesh_, best)) best = i;
    }
    const double step = kJustOutside * bounds_.diagonal().norm();
    std::vector<Vec3> points;
    for (const uint32_t i : largest) {
      const Triangle& t = mesh_.triangles[i];
      const Vec3 &a = mesh_.vertices[t[0]], &b = mesh_.vertices[t[1]], &c = mesh_.vertices[t[2]];
      points.push_back((a + b + c) / 3 + step * (b - a).cross(c - a).normalized());
    }
    return points;
  }

  // Only patches all of whose vertices lie inside of the others. Two that cross are inside each
  // other in places: those stay.
  size_t drop(const std::vector<uint8_t>& is_inside) {
    const auto nested = static_cast<size_t>(std::ranges::count(is_inside, 1));
    if (nested == 0 || nested == count_) return 0;
    TriangleMesh others{.vertices = mesh_.vertices, .triangles = {}};
    for (size_t i = 0; i < mesh_.triangles.size(); ++i) {
      if (!is_inside[patch_[i]]) others.triangles.push_back(mesh_.triangles[i]);
    }
    const InsideTest inside(others);
    std::vector<uint8_t> goes = is_inside;
    for (size_t i = 0; i < mesh_.triangles.size(); ++i) {
      uint8_t& patch_goes = goes[patch_[i]];
      for (const uint32_t vertex : mesh_.triangles[i]) {
        if (patch_goes && !inside.contains(mesh_.vertices[vertex])) patch_goes = 0;
      }
    }
    size_t kept = 0;
    for (size_t i = 0; i < mesh_.triangles.size(); ++i) {
      if (!goes[patch_[i]]) mesh_.triangles[kept++] = mesh_.triangles[i];
    }
    mesh_.triangles.resize(kept);
    return static_cast<size_t>(std::ranges::count(goes, 1));
  }

  TriangleMesh& mesh_;
  const std::vector<uint32_t>& patch_;  // by triangle
  size_t count_;
  Bounds bounds_;
};

}  // namespace

Patches turn_triangles(TriangleMesh& mesh, size_t own) {
  std::vector<Triangle>& triangles = mesh.triangles;
  constexpr uint32_t kNone = UINT32_MAX;
  Patches patches{.of_triangle = std::vector<uint32_t>(triangles.size(), kNone)};
  const HalfEdges sides(triangles, mesh.vertices.size());
  std::vector<uint8_t> is_turned(triangles.size(), 0);
  for (uint32_t seed = 0; seed < triangles.size(); ++seed) {
    if (patches.of_triangle[seed] != kNone) continue;
    std::vector<uint32_t> patch = {seed};
    patches.of_triangle[seed] = patches.count;
    for (size_t next = 0; next < patch.size(); ++next) {
      const uint32_t i = patch[next];
      for (uint32_t k = 0; k < 3; ++k) {
        const uint32_t from = triangles[i][k], to = triangles[i][(k + 1) % 3];
        const std::span<const HalfEdge> both = sides.along(from, to);
        if (both.size() != 2) continue;
        const HalfEdge& other = both[0].triangle == i ? both[1] : both[0];
        if (patches.of_triangle[other.triangle] != kNone) continue;
        const bool runs_alike = triangles[other.triangle][other.corner] == from;
        is_turned[other.triangle] = is_turned[i] != runs_alike;
        patches.of_triangle[other.triangle] = patches.count;
        patch.push_back(other.triangle);
      }
    }
    double area[2] = {0, 0};
    for (const uint32_t i : patch) area[is_turned[i]] += area_of(mesh, i);
    const uint8_t less = area[1] > area[0] ? 0 : 1;
    for (const uint32_t i : patch) {
      if (is_turned[i] != less) continue;
      std::swap(triangles[i][1], triangles[i][2]);
      if (i < own) ++patches.turned;
    }
    ++patches.count;
  }
  return patches;
}

TurnedPatches turn_patches(TriangleMesh& mesh, const Patches& patches, const Bounds& bounds) {
  if (!are_closed(mesh)) return {};  // the wrap is for these
  return PatchTurner(mesh, patches, bounds).run();
}

}  // namespace pilesim
