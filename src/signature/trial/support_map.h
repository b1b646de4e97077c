// The vertices of a convex body that can touch a plane whose normal turns a little.
//
// A vertex v is lowest only where n . (u - v) >= 0 for every other vertex u. If one neighbour
// violates this for every normal within an angle of the plane's, v cannot touch first. The
// remaining few vertices are listed for the cells of a cube around the body, for several angles: a
// search for contacts tests only those and still misses none.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/types.h"

namespace pilesim {

class SupportMap {
 public:
  static constexpr size_t kGroup = 8;
  static constexpr size_t kMostVertices = 65536;
  // Sines of the angles for which there are lists, ascending.
  static constexpr std::array<double, 3> kDeviations = {0.04, 0.15, 0.34};

  // Vertices in the body frame, m, padded with copies. Two cache lines.
  struct alignas(128) Group {
    float x[kGroup], y[kGroup], z[kGroup];
    uint16_t vertex[kGroup];  // their numbers
    float radius;             // largest |vertex|
  };
  struct Candidates {
    std::span<const Group> groups;
    float height_m;  // bound on the height of the centre over a plane that touches any of them
  };

  SupportMap() = default;
  // At most kMostVertices. `edges`: pairs of vertices, in both directions. The hull's edges leave
  // few candidates; other edges give longer lists, which still contain every vertex needed.
  SupportMap(std::span<const Vec3> vertices, std::span<const std::array<uint32_t, 2>> edges);

  // Every vertex that is lowest for some unit normal whose distance from the half line along
  // `normal` is at most `deviation`, itself at most the last of kDeviations. Body frame; `normal`
  // may have any length.
  Candidates around(const Vec3& normal, double deviation) const {
    size_t wide = 0;
    while (deviation > kDeviations[wide]) ++wide;
    const List& list = lists_[wide * kCells + cell_of(normal)];
    return {std::span(groups_).subspan(list.begin, list.count), list.height_m};
  }

 private:
  static constexpr size_t kSide = 12;  // cells along an edge of the cube
  static constexpr size_t kCells = 6 * kSide * kSide;
  struct List {
    uint32_t begin;
    uint32_t count;
    float height_m;
  };
  static size_t cell_of(const Vec3& direction);

  std::vector<List> lists_;  // (kDeviations, kCells)
  std::vector<Group> groups_;
};

// The faces of the cube are +x, -x, +y, ... A cell's position on one is the ratio of the other two
// components, in the order of axes, to the largest.
inline size_t SupportMap::cell_of(const Vec3& direction) {
  const double x = std::abs(direction.x()), y = std::abs(direction.y()),
               z = std::abs(direction.z());
  const Eigen::Index axis = x >= y ? (x >= z ? 0 : 2) : (y >= z ? 1 : 2);
  const double most = direction(axis);
  constexpr double kHalf = kSide / 2.0;
  const auto place = [&](Eigen::Index other) {
    const double at = kHalf + kHalf * (direction(other % 3) / most);
    return std::min(static_cast<size_t>(at), kSide - 1);
  };
  const size_t face = 2 * static_cast<size_t>(axis) + (most < 0 ? 1 : 0);
  return (face * kSide + place(axis + 1)) * kSide + place(axis + 2);
}

}  // namespace pilesim
