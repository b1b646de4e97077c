// How far a body's lowest vertex can be below its centre for normals near a given one.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "core/types.h"

namespace pilesim {

class SupportRange {
 public:
  // Sines of the angles for which there are values, ascending.
  static constexpr std::array<double, 7> kDeviations = {0.03, 0.07, 0.12, 0.18, 0.24, 0.31, 0.4};
  struct Range {
    float least_m, most_m;
  };

  SupportRange() = default;
  explicit SupportRange(std::span<const Vec3> vertices);

  // Over every unit normal whose distance from the half line along `normal` is at most `deviation`.
  // Body frame; any length.
  Range around(const Vec3& normal, double deviation) const {
    size_t wide = 0;
    while (wide < kDeviations.size() && deviation > kDeviations[wide]) ++wide;
    return wide == kDeviations.size() ? whole_ : ranges_[wide * kCells + cell_of(normal)];
  }

 private:
  static constexpr size_t kSide = 12;  // cells along an edge of the cube
  static constexpr size_t kCells = 6 * kSide * kSide;
  static size_t cell_of(const Vec3& direction);

  std::vector<Range> ranges_;  // (kDeviations, kCells)
  Range whole_{};
};

// The faces of the cube are +x, -x, +y, ...; a cell's place on one is the ratio of the other two
// components, in the order of axes, to the largest.
inline size_t SupportRange::cell_of(const Vec3& direction) {
  const double x = std::abs(direction.x()), y = std::abs(direction.y()),
               z = std::abs(direction.z());
  const Eigen::Index axis = x >= y ? (x >= z ? 0 : 2) : (y >= z ? 1 : 2);
  const double most = direction(axis);
  constexpr double kHalf = kSide / 2.0;
  const double scale = kHalf / most;
  const auto place = [&](Eigen::Index other) {
    return std::min(static_cast<size_t>(kHalf + scale * direction(other % 3)), kSide - 1);
  };
  const size_t face = 2 * static_cast<size_t>(axis) + (most < 0 ? 1 : 0);
  return (face * kSide + place(axis + 1)) * kSide + place(axis + 2);
}

}  // namespace pilesim
