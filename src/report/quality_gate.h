// Quality gates: bounds on how sound a pile must be, as the user writes them:
// "penetration>0.02D,unsettled>0,escaped>0,floating>0" fails a pile of which any of these is true.
#pragma once

#include <string>
#include <vector>

#include "core/pile_quality.h"

namespace pilesim {

struct QualityGate {
  std::string text;    // as written: "penetration>0.02D"
  std::string figure;  // "penetration", "unsettled", "escaped" or "floating"
  double limit = 0;    // in metres or diameters for penetration, else bodies
  bool in_diameters = false;
};

// Throws Error(usage) that says which part is wrong, what may stand there, and how to write it.
std::vector<QualityGate> parse_quality_gates(const std::string& text);

struct GateResult {
  QualityGate gate;
  double value = 0;  // in the gate's unit
  bool passed = true;
};
std::vector<GateResult> judge(const std::vector<QualityGate>& gates, const PileQuality& quality);

// "penetration is 0.034 D"
std::string describe_failure(const GateResult& result);

}  // namespace pilesim
