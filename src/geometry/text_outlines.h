// The outlines of a line of text, as a font draws them.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "geometry/flat_regions.h"

namespace pilesim {

// A straight line, or a Bezier curve of the third degree, to `to`.
struct OutlineCurve {
  FlatPoint control[2] = {FlatPoint::Zero(), FlatPoint::Zero()};
  FlatPoint to = FlatPoint::Zero();
  bool is_line = false;
};
struct Letter {
  std::string name;                                 // "'a'", "U+00E4"
  std::vector<std::vector<OutlineCurve>> outlines;  // closed: each starts where its last curve ends
};

// The letters of `text` that are not blank, side by side from x = 0 on, y up from the line on which
// they stand; a capital H is 1 high. No file: the default font. `text` is UTF-8. Throws
// Error(input) with the font's file, if there is one: it is no TrueType or OpenType font, or lacks
// a character; Error(io).
std::vector<Letter> text_letters(const std::string& text,
                                 const std::optional<std::filesystem::path>& font);

// A letter's curves as chords that are no farther from them than `tolerance`.
std::vector<Outline> flattened(const Letter& letter, double tolerance);

}  // namespace pilesim
