// Axes of signatures as charts show them.
#pragma once

#include <string>

#include "signature/table/axis.h"

namespace pilesim {

std::string number(double value);  // for a chart's data

// A node of an axis, angles in degrees, and the axis's label.
double shown(const Axis& axis, size_t node);
double shown_key(const Axis& axis, double key);
std::string label(const Axis& axis);

}  // namespace pilesim
