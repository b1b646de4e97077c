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

// Deepest overlap of a sound pile, in mean body diameters; the gate proposed in docs/compare.md.
inline constexpr double kSoundOverlap = 0.02;
// Shares from which a guide counts as kept (of the bodies inside it) and as filled (of its volume).
inline constexpr double kKeptShape = 0.95, kFilled = 0.85;
Verdict verdict(const nlohmann::ordered_json& figures);

}  // namespace pilesim
