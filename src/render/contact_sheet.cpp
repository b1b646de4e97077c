#include <algorithm>
#include <array>
#include <cassert>

#include "render/image_output.h"
#include "render/label.h"

namespace pilesim {
namespace {

constexpr int kGap = 4;  // pixels
// Height of labels: this many lines fit into a picture, but with enough pixels to read.
constexpr int kLines = 20;
constexpr int kLeastLine = 13;

}  // namespace

std::array<int, 2> contact_sheet_size(std::array<int, 2> picture, size_t count, int columns) {
  const int rows = (static_cast<int>(count) + columns - 1) / columns;
  return {columns * picture[0] + (columns - 1) * kGap, rows * picture[1] + (rows - 1) * kGap};
}

Image contact_sheet(const std::vector<Image>& pictures, const std::vector<std::string>& labels,
                    int columns) {
  assert(!pictures.empty() && pictures.size() == labels.size() && columns >= 1);
  const int width = pictures.front().width;
  const int height = pictures.front().height;
  Image sheet;
  const std::array<int, 2> size = contact_sheet_size({width, height}, pictures.size(), columns);
  sheet.width = size[0];
  sheet.height = size[1];
  sheet.rgb.assign(3 * static_cast<size_t>(sheet.width) * static_cast<size_t>(sheet.height), 255);
  for (size_t i = 0; i < pictures.size(); ++i) {
    const int left = static_cast<int>(i) % columns * (width + kGap);
    const int top = static_cast<int>(i) / columns * (height + kGap);
    const auto row_bytes = 3 * static_cast<ptrdiff_t>(width);
    for (int row = 0; row < height; ++row) {
      std::copy_n(pictures[i].rgb.begin() + row * row_bytes, row_bytes,
                  sheet.rgb.begin() + 3 * (static_cast<ptrdiff_t>(top + row) * sheet.width + left));
    }
    draw_label(sheet, labels[i], {left, top, left + width, top + height},
               std::max(kLeastLine, height / kLines));
  }
  return sheet;
}

}  // namespace pilesim
