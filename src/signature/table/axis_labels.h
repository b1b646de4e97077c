// Labels for the axes of signatures in charts.
#pragma once

#include <string>

#include "signature/table/axis.h"

namespace pilesim {

std::string number(double value);  // for a chart's data

// A node's value as shown, angles in degrees, and the axis's label.
double shown(const Axis& axis, size_t node);
double shown_key(const Axis& axis, double key);
std::string label(const Axis& axis);

}  // namespace pilesim
