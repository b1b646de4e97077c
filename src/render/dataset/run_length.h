// Masks as the COCO format has them: run lengths, column by column.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "render/pass_images.h"

namespace pilesim {

// Runs of pixels that are 0, 1, 0, ... in turn; from top to bottom, then from left to right. The
// first may be 0. `is_set(column, row)` is asked within `box` only; all else is 0.
template <class IsSet>
std::vector<uint32_t> run_lengths(int width, int height, const PixelBox& box, IsSet is_set) {
  std::vector<uint32_t> runs;
  uint64_t begin = 0;  // of the run that is going on
  bool value = false;
  const auto change = [&](uint64_t place) {
    runs.push_back(static_cast<uint32_t>(place - begin));
    begin = place;
    value = !value;
  };
  for (int column = box.column; column < box.column + box.width; ++column) {
    const uint64_t top = static_cast<uint64_t>(column) * static_cast<uint64_t>(height);
    // The column before was set down to the picture's lower side.
    if (value && box.row > 0) change(top);
    for (int row = box.row; row < box.row + box.height; ++row) {
      if (is_set(column, row) != value) change(top + static_cast<uint64_t>(row));
    }
    const int below = box.row + box.height;
    if (value && below < height) change(top + static_cast<uint64_t>(below));
  }
  const int after = box.column + box.width;
  if (value && after < width) {
    change(static_cast<uint64_t>(after) * static_cast<uint64_t>(height));
  }
  runs.push_back(
      static_cast<uint32_t>(static_cast<uint64_t>(width) * static_cast<uint64_t>(height) - begin));
  return runs;
}

// The text of COCO's compressed masks: each run, from the fourth on less the one two before it, in
// groups of five bits, lowest first, as characters from '0' on; the sixth bit says that more
// follow.
std::string compressed_runs(std::span<const uint32_t> runs);

}  // namespace pilesim
