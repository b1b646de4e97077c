// Quality gates: bounds on how sound a pile must be, as the user writes them:
// "penetration>0.02D,unsettled>0,escaped>0,floating>0" fails a pile of which any of these is true,
// "empty>0.1,outside>0.05" one that leaves more than these shares of its guide empty, or of its
// bodies outside of it.
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

// Throws Error(usage) that says which part is wrong, what may stand there, and how to write it.
std::vector<QualityGate> parse_quality_gates(const std::string& text);

struct GateResult {
  QualityGate gate;
  double value = 0;  // in the gate's unit
  bool passed = true;
};
// A gate on the guide fails where there is none.
std::vector<GateResult> judge(const std::vector<QualityGate>& gates, const PileQuality& quality,
                              const std::optional<GuideQuality>& guide = std::nullopt);
// "bodies", "D", "m", "of the guide": of the limit and of the value.
std::string unit_of(const QualityGate& gate);

// "penetration is 0.034 D"
std::string describe_failure(const GateResult& result);

}  // namespace pilesim
