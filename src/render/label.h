// Text on pictures.
#pragma once

#include <string_view>

#include "render/scene_renderer.h"

namespace pilesim {

// Columns left <= x < right, rows top <= y < bottom.
struct Rectangle {
  int left, top, right, bottom;
};

// White letters on a darkened strip in the lower left corner of `tile`, `line` pixels high. `text`
// is UTF-8; control characters, bytes that are none and what the font (DejaVu Sans: Latin, Greek,
// Cyrillic and more) lacks each become one replacement sign. Text wider than the tile ends in an
// ellipsis.
void draw_label(Image& image, std::string_view text, const Rectangle& tile, int line);

}  // namespace pilesim
