#include "geometry/text_outlines.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string_view>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/isolated.h"
#include "core/utf8.h"
#include "geometry/default_font.h"

#define STBTT_STATIC
#define STB_TRUETYPE_IMPLEMENTATION
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#include <stb/stb_truetype.h>
#pragma GCC diagnostic pop

namespace pilesim {
namespace {

constexpr uint64_t kMostFontBytes = uint64_t{64} << 20;
constexpr IsolationLimits kLimits{.memory_bytes = uint64_t{64} << 20, .cpu_s = 5};
constexpr size_t kMostCurves = 100'000;  // of a text

// A curve as the other process sends it; a capital H is 1 high.
struct DrawnCurve {
  uint32_t letter = 0;
  uint32_t character = 0;
  uint8_t kind = 0;  // STBTT_vmove, ...
  double x = 0, y = 0, cx = 0, cy = 0, cx1 = 0, cy1 = 0;
};

// First byte of the other process's answer.
constexpr char kCurves = 'c', kRefusal = 'r';

std::string character_name(char32_t character) {
  char text[40];
  if (character > 0x20 && character < 0x7F) {
    std::snprintf(text, sizeof text, "'%c'", static_cast<char>(character));
  } else {
    std::snprintf(text, sizeof text, "U+%04X", static_cast<unsigned>(character));
  }
  return text;
}

// Runs in the other process, because the reader trusts the numbers in a font.
std::string draw(const std::string& text, std::string_view font) {
  const auto* data = reinterpret_cast<const unsigned char*>(font.data());
  stbtt_fontinfo info{};
  const int offset = font.size() < 12 ? -1 : stbtt_GetFontOffsetForIndex(data, 0);
  if (offset < 0 || stbtt_InitFont(&info, data, offset) == 0) {
    return std::string(1, kRefusal) + "is no TrueType or OpenType font";
  }
  int ascent = 0, descent = 0, gap = 0, left = 0, low = 0, right = 0, high = 0;
  stbtt_GetFontVMetrics(&info, &ascent, &descent, &gap);
  const int capital = stbtt_FindGlyphIndex(&info, 'H');
  const bool is_drawn =
      capital != 0 && stbtt_GetGlyphBox(&info, capital, &left, &low, &right, &high) != 0;
  if (!is_drawn) high = ascent;
  if (high <= 0) return std::string(1, kRefusal) + "is a font without height";
  std::string curves(1, kCurves);
  double pen = 0;
  uint32_t letter = 0;
  for (std::string_view rest = text; !rest.empty();) {
    const char32_t character = take_character(rest);
    const int glyph = stbtt_FindGlyphIndex(&info, static_cast<int>(character));
    if (glyph == 0) {
      return std::string(1, kRefusal) + "has no letter for " + character_name(character);
    }
    stbtt_vertex* vertices = nullptr;
    const int count = stbtt_GetGlyphShape(&info, glyph, &vertices);
    for (int i = 0; i < count; ++i) {
      const stbtt_vertex& v = vertices[i];
      const DrawnCurve curve{.letter = letter,
                             .character = static_cast<uint32_t>(character),
                             .kind = v.type,
                             .x = (pen + v.x) / high,
                             .y = static_cast<double>(v.y) / high,
                             .cx = (pen + v.cx) / high,
                             .cy = static_cast<double>(v.cy) / high,
                             .cx1 = (pen + v.cx1) / high,
                             .cy1 = static_cast<double>(v.cy1) / high};
      curves.append(reinterpret_cast<const char*>(&curve), sizeof curve);
    }
    if (curves.size() > kMostCurves * sizeof(DrawnCurve)) {
      return std::string(1, kRefusal) + "draws this text with more than " +
             std::to_string(kMostCurves) + " curves";
    }
    stbtt_FreeShape(&info, vertices);
    int advance = 0, bearing = 0;
    stbtt_GetGlyphHMetrics(&info, glyph, &advance, &bearing);
    pen += advance;
    ++letter;
  }
  return curves;
}

OutlineCurve curve_of(const DrawnCurve& drawn, const FlatPoint& from) {
  const FlatPoint to(drawn.x, drawn.y), first(drawn.cx, drawn.cy), second(drawn.cx1, drawn.cy1);
  if (drawn.kind == STBTT_vcubic) return {{first, second}, to, false};
  // One of the second degree has one control point.
  if (drawn.kind == STBTT_vcurve) {
    return {{from + 2.0 / 3 * (first - from), to + 2.0 / 3 * (first - to)}, to, false};
  }
  return {{from, to}, to, true};
}

std::vector<Letter> letters_of(std::string_view bytes) {
  std::vector<Letter> letters;
  uint32_t last = ~uint32_t{0};
  FlatPoint pen = FlatPoint::Zero(), start = pen;
  const auto close = [&] {
    if (letters.empty() || letters.back().outlines.empty() || pen == start) return;
    letters.back().outlines.back().push_back({{pen, start}, start, true});
  };
  for (; bytes.size() >= sizeof(DrawnCurve); bytes.remove_prefix(sizeof(DrawnCurve))) {
    DrawnCurve drawn;
    std::memcpy(&drawn, bytes.data(), sizeof drawn);
    if (drawn.kind == STBTT_vmove) {
      close();
      if (drawn.letter != last) letters.push_back({.name = character_name(drawn.character)});
      last = drawn.letter;
      letters.back().outlines.emplace_back();
      start = pen = {drawn.x, drawn.y};
    } else if (!letters.empty()) {
      letters.back().outlines.back().push_back(curve_of(drawn, pen));
      pen = {drawn.x, drawn.y};
    }
  }
  close();
  return letters;
}

FlatPoint point_on(const FlatPoint& from, const OutlineCurve& curve, double share) {
  const double rest = 1 - share;
  return rest * rest * rest * from + 3 * rest * rest * share * curve.control[0] +
         3 * rest * share * share * curve.control[1] + share * share * share * curve.to;
}

// Chords of n equal steps are at most 3/4 of the control points' second difference / n^2 off.
int steps_of(const FlatPoint& from, const OutlineCurve& curve, double tolerance) {
  constexpr int kMost = 64;
  if (curve.is_line) return 1;
  const FlatPoint bend_at_start = from - 2 * curve.control[0] + curve.control[1];
  const FlatPoint bend_at_end = curve.control[0] - 2 * curve.control[1] + curve.to;
  const double bend = std::max(bend_at_start.norm(), bend_at_end.norm());
  return static_cast<int>(
      std::clamp(std::ceil(std::sqrt(0.75 * bend / tolerance)), 1.0, static_cast<double>(kMost)));
}

}  // namespace

std::vector<Letter> text_letters(const std::string& text,
                                 const std::optional<std::filesystem::path>& font) {
  const std::string own = font ? read_file(*font, kMostFontBytes) : std::string();
  const std::string_view bytes = font ? std::string_view(own) : default_font();
  const IsolatedResult drawn = run_isolated([&] { return draw(text, bytes); }, kLimits);
  std::string fault =
      drawn.fault.empty() ? "" : "cannot be read as a font: its reader " + drawn.fault;
  if (fault.empty() && drawn.bytes.starts_with(kRefusal)) fault = drawn.bytes.substr(1);
  if (!fault.empty()) {
    throw Error(ErrorKind::input,
                Problem{.file = font ? font->string() : "",
                        .found = font ? fault : "the default font " + fault,
                        .expected = "a TrueType or OpenType font with all letters of the text",
                        .remedy = R"(Name another "font")"});
  }
  return letters_of(std::string_view(drawn.bytes).substr(1));
}

std::vector<Outline> flattened(const Letter& letter, double tolerance) {
  std::vector<Outline> outlines;
  for (const std::vector<OutlineCurve>& curves : letter.outlines) {
    if (curves.empty()) continue;
    Outline& outline = outlines.emplace_back();
    FlatPoint from = curves.back().to;
    for (const OutlineCurve& curve : curves) {
      const int steps = steps_of(from, curve, tolerance);
      for (int step = 1; step < steps; ++step) {
        outline.push_back(point_on(from, curve, static_cast<double>(step) / steps));
      }
      outline.push_back(curve.to);
      from = curve.to;
    }
  }
  return outlines;
}

}  // namespace pilesim
