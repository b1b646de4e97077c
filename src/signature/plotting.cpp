#include "signature/plotting.h"

#include <cstdio>

#include "core/atomic_file.h"
#include "core/subprocess.h"
#include "core/types.h"

namespace pilesim {
namespace {

namespace fs = std::filesystem;

constexpr const char* kStyle =
    "set border 3 lc rgb '#888888'\nset tics nomirror textcolor rgb '#444444'\n"
    "set key textcolor rgb '#444444' samplen 1.5\n";

bool is_angle(const Axis& axis) { return axis.unit == "rad"; }

}  // namespace

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

// gnuplot prints the picture to its stdout.
fs::path draw(const fs::path& file, int width, int height, const std::string& script) {
  const std::string terminal = "set terminal pngcairo size " + std::to_string(width) + "," +
                               std::to_string(height) + " font 'sans,11' background '#ffffff'\n";
  write_file_atomically(file, run_program({"gnuplot"}, "gnuplot-nox", terminal + kStyle + script));
  return file;
}

double shown(const Axis& axis, size_t node) { return shown_key(axis, axis.nodes[node]); }
double shown_key(const Axis& axis, double key) { return is_angle(axis) ? degrees(key) : key; }
std::string label(const Axis& axis) {
  std::string name = axis.name;
  for (char& c : name) c = c == '_' ? ' ' : c;
  return name + " (" + (is_angle(axis) ? "deg" : axis.unit) + ")";
}

}  // namespace pilesim
