#include <stb/stb_easy_font.h>

#include <algorithm>
#include <array>
#include <cassert>

#include "render/image_output.h"

namespace pilesim {
namespace {

constexpr int kGap = 4;  // pixels

// Columns left <= x < right, rows top <= y < bottom.
struct Rectangle {
  int left, top, right, bottom;
};

// `share` of `value` over what is there; cut at the image's edges.
void fill(Image& image, Rectangle r, uint8_t value, double share) {
  r = {std::max(r.left, 0), std::max(r.top, 0), std::min(r.right, image.width),
       std::min(r.bottom, image.height)};
  for (int y = r.top; y < r.bottom; ++y) {
    const auto row = static_cast<ptrdiff_t>(y) * image.width;
    for (ptrdiff_t i = 3 * (row + r.left); i < 3 * (row + r.right); ++i) {
      uint8_t& byte = image.rgb[static_cast<size_t>(i)];
      byte = static_cast<uint8_t>(byte + share * (value - byte));
    }
  }
}

// White on a darkened strip in the lower left corner of the tile at `left`; `bottom` is its end.
void draw_label(Image& sheet, std::string label, int left, int bottom, int scale) {
  if (label.empty()) return;
  struct Vertex {
    float x, y, z;
    std::array<uint8_t, 4> colour;
  };
  // A letter takes about ten strokes at most, a stroke is four vertices.
  std::vector<Vertex> vertices(64 * label.size());
  const int quads = stb_easy_font_print(0, 0, label.data(), nullptr, vertices.data(),
                                        static_cast<int>(vertices.size() * sizeof(Vertex)));
  const int text_width = scale * stb_easy_font_width(label.data());
  const int height = 12 * scale;
  const int margin = 3 * scale;
  fill(sheet, {left, bottom - height - margin, left + text_width + 2 * margin, bottom}, 0, 0.45);
  const auto pixels = [scale](float units) { return static_cast<int>(units) * scale; };
  for (size_t quad = 0; quad < static_cast<size_t>(quads); ++quad) {
    const Vertex& low = vertices[4 * quad];
    const Vertex& high = vertices[4 * quad + 2];
    const int x = left + margin;
    const int y = bottom - height;
    fill(sheet, {x + pixels(low.x), y + pixels(low.y), x + pixels(high.x), y + pixels(high.y)}, 255,
         1);
  }
}

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
    draw_label(sheet, labels[i], left, top + height, std::max(1, height / 270));
  }
  return sheet;
}

}  // namespace pilesim
