#include "geometry/coordinate_rounding.h"

#include <algorithm>
#include <cmath>

namespace pilesim {
namespace {

// Unit of the last of `digits` decimal digits.
double unit(double value, int digits) {
  return std::pow(10.0, std::floor(std::log10(value)) - digits + 1);
}

// Within two steps of the precision, since importers convert digit by digit.
bool has_digits(double value, int digits, double step) {
  const double units = value / unit(value, digits);
  return std::abs(units - std::round(units)) <= 2 * step * units;
}

}  // namespace

void CoordinateRounding::add(double coordinate) {
  const double value = std::abs(coordinate), step = most_digits_ > 7 ? 0x1p-51 : 0x1p-23;
  if (!(value > 0)) return;
  largest_ = std::max(largest_, value);
  while (digits_ < most_digits_ && !has_digits(value, digits_, step)) ++digits_;
}

double CoordinateRounding::bound() const {
  if (!(largest_ > 0)) return 0;
  return std::sqrt(3.0) / 2 * unit(largest_, digits_);
}

}  // namespace pilesim
