// Things in the order of a curve through their places, so that those that are near each other in
// space mostly are so in memory. It goes through cubic cells (Morton's order); what has one cell
// keeps its order.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "core/types.h"

namespace pilesim::exact {

class CurveOrder {
 public:
  // `place_of(item)` in m.
  template <typename PlaceOf>
  void sort(std::vector<uint32_t>& items, const PlaceOf& place_of) {
    Bounds box;
    for (const uint32_t item : items) box.extend(place_of(item));
    const double extent = items.empty() ? 0 : box.sizes().maxCoeff();
    const double cells = extent > 0 ? kCells / extent : 0;
    codes_.clear();
    for (const uint32_t item : items) {
      const Vec3 cell = cells * (place_of(item) - box.min());
      uint32_t code = 0;
      for (int k = 0; k < 3; ++k) {
        code |= spread(std::min(static_cast<uint32_t>(cell[k]), kCells - 1)) << k;
      }
      codes_.push_back(uint64_t{code} << 32 | item);
    }
    by_digit(32);
    by_digit(32 + kDigitBits);
    for (size_t i = 0; i < items.size(); ++i) items[i] = static_cast<uint32_t>(codes_[i]);
  }

 private:
  static constexpr uint32_t kCells = 128;  // along the longest side
  static constexpr uint32_t kDigitBits = 11, kDigits = 1 << kDigitBits;

  // Every third bit of the result is one of `v`, which has seven.
  static uint32_t spread(uint32_t v) {
    v = (v | (v << 8)) & 0x0000700F;
    v = (v | (v << 4)) & 0x000430C3;
    return (v | (v << 2)) & 0x00049249;
  }

  void by_digit(uint32_t shift) {
    std::array<uint32_t, kDigits + 1> first{};
    const auto digit = [&](uint64_t code) {
      return static_cast<uint32_t>(code >> shift) & (kDigits - 1);
    };
    for (const uint64_t code : codes_) ++first[digit(code) + 1];
    for (size_t i = 1; i <= kDigits; ++i) first[i] += first[i - 1];
    sorted_.resize(codes_.size());
    for (const uint64_t code : codes_) sorted_[first[digit(code)]++] = code;
    std::swap(codes_, sorted_);
  }

  std::vector<uint64_t> codes_, sorted_;  // the cell's number on the curve, and the item
};

}  // namespace pilesim::exact
