// The verdict on a run, in words.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace pilesim {

struct Verdict {
  bool good = true;
  std::string headline;                // "At rest and sound"
  std::vector<std::string> sentences;  // settled? sound? how fast?
};

// Deepest overlap of a sound pile, in diameters of the mean body: what docs/compare.md proposes as
// a gate. Plain HTML; `figures` is what report_json() gave.
inline constexpr double kSoundOverlap = 0.02;
// Shares, of the bodies that are inside of a guide whose shape is kept, and of its volume from
// which on it counts as filled.
inline constexpr double kKeptShape = 0.95, kFilled = 0.85;
Verdict verdict(const nlohmann::ordered_json& figures);

}  // namespace pilesim
