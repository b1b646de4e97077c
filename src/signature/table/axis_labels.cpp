#include "signature/table/axis_labels.h"

#include "core/text.h"
#include "core/types.h"

namespace pilesim {
namespace {

bool is_angle(const Axis& axis) { return axis.unit == "rad"; }

}  // namespace

std::string number(double value) { return with_digits(value, 6); }
double shown(const Axis& axis, size_t node) { return shown_key(axis, axis.nodes[node]); }
double shown_key(const Axis& axis, double key) { return is_angle(axis) ? degrees(key) : key; }
std::string label(const Axis& axis) {
  std::string name = axis.name;
  for (char& c : name) c = c == '_' ? ' ' : c;
  return name + " (" + (is_angle(axis) ? "deg" : axis.unit) + ")";
}

}  // namespace pilesim
