#include "signature/support_range.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace pilesim {
namespace {

// Added to angles and, relatively, to heights for rounding, here and in the flights.
constexpr double kRounding = 1e-5;

struct Cone {
  Vec3 axis;
  double angle;
};

// Around a cell of the cube, see cell_of().
Cone cone_of_cell(size_t cell, size_t side) {
  const size_t face = cell / (side * side), row = cell / side % side, column = cell % side;
  const auto axis = static_cast<Eigen::Index>(face / 2);
  const auto direction = [&](double r, double c) {
    Vec3 d;
    d(axis) = 1;
    d((axis + 1) % 3) = 2 * (static_cast<double>(row) + r) / static_cast<double>(side) - 1;
    d((axis + 2) % 3) = 2 * (static_cast<double>(column) + c) / static_cast<double>(side) - 1;
    return Vec3(d.normalized() * (face % 2 == 0 ? 1 : -1));
  };
  Cone cone{direction(0.5, 0.5), 0};
  for (const double r : {0.0, 1.0}) {
    for (const double c : {0.0, 1.0}) {
      cone.angle = std::max(cone.angle, std::acos(cone.axis.dot(direction(r, c))));
    }
  }
  return cone;
}

}  // namespace

SupportRange::SupportRange(std::span<const Vec3> vertices) {
  ranges_.resize(kDeviations.size() * kCells);
  double outer = 0;
  for (const Vec3& v : vertices) outer = std::max(outer, v.norm());
  whole_ = {std::numeric_limits<float>::max(), static_cast<float>(outer * (1 + kRounding))};
  std::array<double, kDeviations.size()> sine, cosine, most, least;
  for (size_t cell = 0; cell < kCells; ++cell) {
    const Cone cone = cone_of_cell(cell, kSide);
    for (size_t i = 0; i < kDeviations.size(); ++i) {
      const double angle = std::asin(kDeviations[i]) + cone.angle + kRounding;
      sine[i] = std::sin(angle), cosine[i] = std::cos(angle);
    }
    most.fill(0), least.fill(0);
    for (const Vec3& v : vertices) {
      const double below = -v.dot(cone.axis), squared = v.squaredNorm();
      const double across = std::sqrt(std::max(0.0, squared - below * below));
      for (size_t i = 0; i < kDeviations.size(); ++i) {
        // A vertex inside the cone itself comes as far down as it is long.
        const bool inside = below > 0 && across * cosine[i] <= below * sine[i];
        most[i] =
            std::max(most[i], inside ? std::sqrt(squared) : below * cosine[i] + across * sine[i]);
        least[i] = std::max(least[i], below * cosine[i] - across * sine[i]);
      }
    }
    for (size_t i = 0; i < kDeviations.size(); ++i) {
      ranges_[i * kCells + cell] = {static_cast<float>(least[i] * (1 - kRounding)),
                                    static_cast<float>(most[i] * (1 + kRounding))};
      whole_.least_m = std::min(whole_.least_m, ranges_[i * kCells + cell].least_m);
    }
  }
}

}  // namespace pilesim
