// What pictures of signatures share: gnuplot, numbers and names of axes.
#pragma once

#include <filesystem>
#include <string>

#include "signature/axis.h"

namespace pilesim {

std::string number(double value);

// Runs a script of gnuplot and writes the picture (PNG, pixels). Gives `file`. Throws Error(io).
std::filesystem::path draw(const std::filesystem::path& file, int width, int height,
                           const std::string& script);

// A node of an axis, angles in degrees, and the axis's label.
double shown(const Axis& axis, size_t node);
double shown_key(const Axis& axis, double key);
std::string label(const Axis& axis);

}  // namespace pilesim
