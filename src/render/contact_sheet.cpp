#include <algorithm>
#include <cassert>

#include "render/image_output.h"

namespace pilesim {

Image contact_sheet(const std::vector<Image>& pictures, int columns) {
  assert(!pictures.empty() && columns >= 1);
  constexpr int kGap = 4;  // pixels
  const int width = pictures.front().width;
  const int height = pictures.front().height;
  const int rows = (static_cast<int>(pictures.size()) + columns - 1) / columns;
  Image sheet;
  sheet.width = columns * width + (columns - 1) * kGap;
  sheet.height = rows * height + (rows - 1) * kGap;
  sheet.rgb.assign(3 * static_cast<size_t>(sheet.width) * static_cast<size_t>(sheet.height), 255);
  for (size_t i = 0; i < pictures.size(); ++i) {
    const int left = static_cast<int>(i) % columns * (width + kGap);
    const int top = static_cast<int>(i) / columns * (height + kGap);
    const auto row_bytes = 3 * static_cast<ptrdiff_t>(width);
    for (int row = 0; row < height; ++row) {
      std::copy_n(pictures[i].rgb.begin() + row * row_bytes, row_bytes,
                  sheet.rgb.begin() + 3 * (static_cast<ptrdiff_t>(top + row) * sheet.width + left));
    }
  }
  return sheet;
}

}  // namespace pilesim
