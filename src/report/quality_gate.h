// Quality gates: bounds on the soundness of a pile, as written by the user.
// "penetration>0.02D,unsettled>0,escaped>0,floating>0" fails a pile for which any of these is true.
// "empty>0.1,outside>0.05" fails one that leaves more than these shares of its guide empty, or of
// its bodies outside it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/pile_quality.h"

namespace pilesim {

struct QualityGate {
  std::string text;    // as written: "penetration>0.02D"
  std::string figure;  // "penetration", "unsettled", "escaped", "floating", "empty" or "outside"
  double limit = 0;    // in metres or diameters for penetration, a share of a guide, else bodies
  bool in_diameters = false;
};

// Throws Error(usage) that names the wrong part, the valid values and the syntax.
std::vector<QualityGate> parse_quality_gates(const std::string& text);

struct GateResult {
  QualityGate gate;
  double value = 0;  // in the gate's unit
  bool passed = true;
};
// A gate on the guide fails if there is no guide.
std::vector<GateResult> judge(const std::vector<QualityGate>& gates, const PileQuality& quality,
                              const std::optional<GuideQuality>& guide = std::nullopt);
// Unit of the limit and the value: "bodies", "D", "m", "of the guide".
std::string unit_of(const QualityGate& gate);

// "penetration is 0.034 D"
std::string describe_failure(const GateResult& result);

}  // namespace pilesim
