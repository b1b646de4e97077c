#include "report/quality_gate.h"

#include <charconv>
#include <cmath>
#include <string_view>

#include "core/counted.h"
#include "core/error.h"
#include "core/text.h"

namespace pilesim {
namespace {

constexpr char kExample[] = "Write for example penetration>0.02D,unsettled>0,escaped>0,floating>0";

bool is_of_guide(const QualityGate& gate) {
  return gate.figure == "empty" || gate.figure == "outside";
}

Error gate_error(std::string found, std::string expected) {
  return {ErrorKind::usage, Problem{.file = "--fail-on",
                                    .found = std::move(found),
                                    .expected = std::move(expected),
                                    .remedy = kExample}};
}

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
  return text;
}

QualityGate parse_gate(std::string_view text) {
  const size_t above = text.find('>');
  if (above == text.npos) {
    throw gate_error("\"" + std::string(text) + "\" has no '>'", "FIGURE>LIMIT");
  }
  QualityGate gate{.text = std::string(text),
                   .figure = std::string(trimmed(text.substr(0, above)))};
  const bool is_length = gate.figure == "penetration";
  if (!is_length && gate.figure != "unsettled" && gate.figure != "escaped" &&
      gate.figure != "floating" && !is_of_guide(gate)) {
    throw gate_error("\"" + gate.figure + "\" is no figure of a pile",
                     "penetration, unsettled, escaped, floating, empty or outside");
  }
  const std::string_view limit = trimmed(text.substr(above + 1));
  const char* const end = limit.data() + limit.size();
  const auto [rest, fault] = std::from_chars(limit.data(), end, gate.limit);
  const std::string_view unit = trimmed({rest, static_cast<size_t>(end - rest)});
  if (fault != std::errc() || !std::isfinite(gate.limit) || gate.limit < 0) {
    throw gate_error("\"" + gate.text + "\": the limit is \"" + std::string(limit) + "\"",
                     "a number of at least 0");
  }
  if (is_length ? unit != "D" && unit != "m" : !unit.empty()) {
    throw gate_error("\"" + gate.text + "\": the limit is \"" + std::string(limit) + "\"",
                     is_length           ? "a length in diameters or metres: 0.02D or 0.004m"
                     : is_of_guide(gate) ? "a share from 0 to 1"
                                         : "a number of bodies");
  }
  gate.in_diameters = unit == "D";
  return gate;
}

}  // namespace

std::vector<QualityGate> parse_quality_gates(const std::string& text) {
  std::vector<QualityGate> gates;
  std::string_view rest = text;
  for (;;) {
    const size_t comma = rest.find(',');
    gates.push_back(parse_gate(trimmed(rest.substr(0, comma))));
    if (comma == rest.npos) return gates;
    rest.remove_prefix(comma + 1);
  }
}

std::vector<GateResult> judge(const std::vector<QualityGate>& gates, const PileQuality& quality,
                              const std::optional<GuideQuality>& guide) {
  std::vector<GateResult> results;
  for (const QualityGate& gate : gates) {
    GateResult& result = results.emplace_back(GateResult{.gate = gate});
    if (gate.figure == "penetration") {
      result.value = quality.deepest_penetration_m;
      if (gate.in_diameters && quality.body_diameter_m > 0) {
        result.value /= quality.body_diameter_m;
      }
    } else if (is_of_guide(gate)) {
      result.value = !guide                   ? std::nan("")
                     : gate.figure == "empty" ? guide->empty_share
                                              : guide->outside_share;
    } else {
      result.value = static_cast<double>(gate.figure == "unsettled" ? quality.unsettled
                                         : gate.figure == "escaped" ? quality.escaped
                                                                    : quality.floating);
    }
    result.passed = result.value <= gate.limit;  // NaN fails
  }
  return results;
}

std::string describe_failure(const GateResult& result) {
  const std::string found = result.gate.figure + " is ";
  if (result.gate.figure == "penetration") {
    return found + with_digits(result.value, 3) + (result.gate.in_diameters ? " D" : " m");
  }
  if (is_of_guide(result.gate)) {
    if (std::isnan(result.value)) return found + "unknown: no guide was followed";
    return found + with_digits(result.value, 3) + ' ' + unit_of(result.gate);
  }
  return found + counted(static_cast<uint64_t>(result.value), "body", "bodies");
}

std::string unit_of(const QualityGate& gate) {
  if (is_of_guide(gate)) return gate.figure == "empty" ? "of the guide" : "of the bodies";
  if (gate.figure != "penetration") return "bodies";
  return gate.in_diameters ? "D" : "m";
}

}  // namespace pilesim
