#include "export/unit_halves.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace pilesim {

std::array<float, 4> unit_halves(const Quatf& q) {
  constexpr int kDigits = 11, kLeastExponent = -14;
  const std::array<float, 4> exact = {q.w(), q.x(), q.y(), q.z()};
  std::array<std::array<double, 2>, 4> sides{};  // nearest values below and above, by size
  for (size_t k = 0; k < 4; ++k) {
    const auto size = static_cast<double>(std::abs(exact[k]));
    const int exponent = size > 0 ? std::max(std::ilogb(size), kLeastExponent) : kLeastExponent;
    const double unit = std::exp2(exponent - kDigits + 1);
    sides[k] = {std::floor(size / unit) * unit, std::ceil(size / unit) * unit};
  }
  std::array<float, 4> best{};
  double least = std::numeric_limits<double>::infinity();
  for (size_t way = 0; way < 16; ++way) {
    double square = 0;
    for (size_t k = 0; k < 4; ++k) square += sides[k][way >> k & 1] * sides[k][way >> k & 1];
    if (std::abs(square - 1) >= least) continue;
    least = std::abs(square - 1);
    for (size_t k = 0; k < 4; ++k) {
      best[k] = std::copysign(static_cast<float>(sides[k][way >> k & 1]), exact[k]);
    }
  }
  return best;
}

}  // namespace pilesim
