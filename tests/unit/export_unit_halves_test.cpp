// Quaternions in half precision.
#include "export/unit_halves.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace pilesim {
namespace {

double length(const std::array<float, 4>& wxyz) {
  double square = 0;
  for (const float value : wxyz) square += static_cast<double>(value) * static_cast<double>(value);
  return std::sqrt(square);
}

// Rounds a number in [2^-14, 1] to the nearest half.
float half(float value) {
  if (value == 0) return 0;
  const auto unit = std::exp2f(static_cast<float>(std::ilogb(value) - 10));
  return std::nearbyintf(value / unit) * unit;
}

TEST(UnitHalves, AreHalvesWithLengthsNearerTo1ThanTheNearestOnes) {
  std::mt19937 random(7);
  std::normal_distribution<float> normal;
  double worst = 0, worst_of_nearest = 0;
  for (int i = 0; i < 5000; ++i) {
    std::array<float, 4> drawn{};
    for (float& value : drawn) value = normal(random);
    const Quatf q = Quatf(drawn[0], drawn[1], drawn[2], drawn[3]).normalized();
    const std::array<float, 4> found = unit_halves(q);
    const std::array<float, 4> exact = {q.w(), q.x(), q.y(), q.z()};
    std::array<float, 4> nearest{};
    for (size_t k = 0; k < 4; ++k) {
      nearest[k] = half(exact[k]);
      EXPECT_EQ(found[k], half(found[k]));
      EXPECT_LE(std::abs(found[k] - exact[k]), 0x1p-11);
    }
    EXPECT_LE(std::abs(length(found) - 1), std::abs(length(nearest) - 1) + 1e-9);
    worst = std::max(worst, std::abs(length(found) - 1));
    worst_of_nearest = std::max(worst_of_nearest, std::abs(length(nearest) - 1));
  }
  EXPECT_LT(worst, worst_of_nearest);
  EXPECT_EQ(unit_halves(Quatf::Identity()), (std::array<float, 4>{1, 0, 0, 0}));
}

}  // namespace
}  // namespace pilesim
