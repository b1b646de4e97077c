#include "geometry/coordinate_rounding.h"

#include <algorithm>
#include <cmath>

namespace pilesim {
namespace {

constexpr int kMostDigits = 7;

// Of the last of `digits` decimal digits.
double unit(double value, int digits) {
  return std::pow(10.0, std::floor(std::log10(value)) - digits + 1);
}

// Within two steps of single precision, since importers convert digit by digit.
bool has_digits(double value, int digits) {
  const double units = value / unit(value, digits);
  return std::abs(units - std::round(units)) <= 0x1p-22 * units;
}

}  // namespace

void CoordinateRounding::add(float coordinate) {
  const float value = std::abs(coordinate);
  if (!(value > 0)) return;
  largest_ = std::max(largest_, value);
  while (digits_ < kMostDigits && !has_digits(static_cast<double>(value), digits_)) ++digits_;
}

double CoordinateRounding::bound() const {
  if (!(largest_ > 0)) return 0;
  return std::sqrt(3.0) / 2 * unit(static_cast<double>(largest_), digits_);
}

}  // namespace pilesim
