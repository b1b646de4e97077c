#include "render/label.h"

#define STBTT_STATIC
#define STB_TRUETYPE_IMPLEMENTATION
#include <stb/stb_truetype.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/utf8.h"
#include "geometry/default_font.h"

namespace pilesim {
namespace {

constexpr char32_t kEllipsis = 0x2026;

class Font {
 public:
  // Letters from the lowest descender to the highest ascender take `line` pixels.
  explicit Font(int line) {
    stbtt_InitFont(&info_, reinterpret_cast<const unsigned char*>(default_font().data()), 0);
    int ascent = 0, descent = 0, gap = 0;
    stbtt_GetFontVMetrics(&info_, &ascent, &descent, &gap);
    scale_ = stbtt_ScaleForPixelHeight(&info_, static_cast<float>(line));
    ascent_ = static_cast<int>(std::lround(scale_ * static_cast<float>(ascent)));
  }

  int glyph_of(char32_t character) const {
    const bool control = character < 0x20 || (character >= 0x7F && character < 0xA0);
    const int glyph = control ? 0 : stbtt_FindGlyphIndex(&info_, static_cast<int>(character));
    return glyph != 0 ? glyph
                      : stbtt_FindGlyphIndex(&info_, static_cast<int>(kReplacementCharacter));
  }

  // Pixels to the next letter.
  float advance(int glyph) const {
    int advance = 0, bearing = 0;
    stbtt_GetGlyphHMetrics(&info_, glyph, &advance, &bearing);
    return scale_ * static_cast<float>(advance);
  }

  // White, by how much of each pixel the letter covers; cut at `clip`.
  void draw(int glyph, float x, int top, const Rectangle& clip, Image& image) const {
    const float column = std::floor(x);
    int width = 0, height = 0, left = 0, above = 0;
    unsigned char* cover = stbtt_GetGlyphBitmapSubpixel(&info_, scale_, scale_, x - column, 0,
                                                        glyph, &width, &height, &left, &above);
    left += static_cast<int>(column);
    above += top + ascent_;
    for (int row = 0; row < height; ++row) {
      for (int i = 0; i < width; ++i) {
        const int at_x = left + i, at_y = above + row;
        if (at_x < clip.left || at_x >= clip.right || at_y < clip.top || at_y >= clip.bottom)
          continue;
        const int share = cover[row * width + i];
        const size_t at = 3 * (static_cast<size_t>(at_y) * static_cast<size_t>(image.width) +
                               static_cast<size_t>(at_x));
        for (size_t c = 0; c < 3; ++c) {
          uint8_t& byte = image.rgb[at + c];
          byte = static_cast<uint8_t>(byte + (255 - byte) * share / 255);
        }
      }
    }
    stbtt_FreeBitmap(cover, nullptr);
  }

 private:
  stbtt_fontinfo info_{};
  float scale_ = 1;
  int ascent_ = 0;  // pixels from the line's top to the letters' foot
};

struct Letter {
  int glyph;
  float x, end;  // pixels from the text's left
};

// At most `width` pixels of them.
std::vector<Letter> set_text(const Font& font, std::string_view text, float width) {
  std::vector<Letter> letters;
  float x = 0;
  const auto append = [&](int glyph) {
    letters.push_back({glyph, x, x + font.advance(glyph)});
    x = letters.back().end;
  };
  while (!text.empty() && x <= width) append(font.glyph_of(take_character(text)));
  if (x <= width) return letters;
  const int ellipsis = font.glyph_of(kEllipsis);
  while (!letters.empty() && x + font.advance(ellipsis) > width) {
    x = letters.back().x;
    letters.pop_back();
  }
  append(ellipsis);
  return letters;
}

void darken(Image& image, const Rectangle& r) {
  constexpr double kShare = 0.55;
  for (int y = r.top; y < r.bottom; ++y) {
    const auto row = static_cast<ptrdiff_t>(y) * image.width;
    for (ptrdiff_t i = 3 * (row + r.left); i < 3 * (row + r.right); ++i) {
      uint8_t& byte = image.rgb[static_cast<size_t>(i)];
      byte = static_cast<uint8_t>(kShare * byte);
    }
  }
}

}  // namespace

void draw_label(Image& image, std::string_view text, const Rectangle& tile, int line) {
  if (text.empty()) return;
  const Font font(line);
  const int margin = std::max(1, line / 4);
  const std::vector<Letter> letters =
      set_text(font, text, static_cast<float>(tile.right - tile.left - 2 * margin));
  const int text_width = static_cast<int>(std::ceil(letters.back().end));
  const Rectangle strip = {tile.left, std::max(tile.top, tile.bottom - line - margin),
                           std::min(tile.right, tile.left + text_width + 2 * margin), tile.bottom};
  darken(image, strip);
  for (const Letter& letter : letters) {
    font.draw(letter.glyph, static_cast<float>(tile.left + margin) + letter.x,
              tile.bottom - line - margin / 2, strip, image);
  }
}

}  // namespace pilesim
