#include "signature/table/response_table.h"

#include <algorithm>
#include <cmath>

namespace pilesim {
namespace {

Axis even_axis(std::string name, std::string unit, double first, double last, int count) {
  Axis axis{.name = std::move(name), .unit = std::move(unit)};
  for (int i = 0; i < count; ++i) {
    axis.nodes.push_back(static_cast<float>(first + (last - first) * i / (count - 1)));
  }
  return axis;
}

// Nodes are denser towards zero, where responses change most.
Axis squared_axis(std::string name, std::string unit, double first_part, double last, int count) {
  Axis axis{.name = std::move(name), .unit = std::move(unit)};
  for (int i = 0; i < count; ++i) {
    const double part = first_part + (1 - first_part) * i / (count - 1);
    axis.nodes.push_back(static_cast<float>(last * part * part));
  }
  return axis;
}

constexpr double kSteepest = radians(84);     // theta: at 90 degrees nothing collides
constexpr double kFastestSpin = radians(87);  // alpha: the same
constexpr double kTopSpeed_m_s = 10;          // of the dissertation's layout; 10 m/s is a 5 m fall

}  // namespace

std::string layout_name(TableLayout layout) {
  return layout == TableLayout::dissertation ? "dissertation" : "scale-free";
}

std::array<uint32_t, 4> ResponseTable::cell_index(size_t cell) const {
  std::array<uint32_t, 4> index;
  for (size_t i = 4; i-- > 0;) {
    index[i] = static_cast<uint32_t>(cell % axes[i].size());
    cell /= axes[i].size();
  }
  return index;
}

ResponseTable make_table(TableLayout layout, double gyration_m) {
  ResponseTable table;
  table.layout = layout;
  if (layout == TableLayout::dissertation) {
    table.axes = {even_axis("theta", "rad", 0, kSteepest, 7), even_axis("phi", "rad", 0, kPi, 10),
                  squared_axis("speed", "m/s", 0.15, kTopSpeed_m_s, 26),
                  squared_axis("spin", "rad/s", 0, kTopSpeed_m_s / gyration_m, 16)};
  } else {
    Axis psi = even_axis("psi", "rad", -kPi, kPi, 13);
    psi.nodes.pop_back();
    psi.period = static_cast<float>(2 * kPi);
    table.axes = {even_axis("theta", "rad", 0, kSteepest, 7), even_axis("phi", "rad", 0, kPi, 7),
                  psi, even_axis("alpha", "rad", 0, kFastestSpin, 10)};
  }
  return table;
}

Vec3 spin_direction(double theta, double phi, double psi) {
  const Vec3 along(std::sin(theta), -std::cos(theta), 0);
  const Vec3 side(std::cos(theta), std::sin(theta), 0);  // z cross along
  return std::cos(phi) * along +
         std::sin(phi) * (std::cos(psi) * side + std::sin(psi) * Vec3::UnitZ());
}

CellConfiguration cell_configuration(const ResponseTable& table, size_t cell, double gyration_m) {
  const std::array<uint32_t, 4> index = table.cell_index(cell);
  std::array<double, 4> key;
  for (size_t i = 0; i < 4; ++i) key[i] = table.axes[i].nodes[index[i]];
  const bool raw = table.layout == TableLayout::dissertation;
  const double speed = raw ? key[2] : std::cos(key[3]);
  const double spin = raw ? key[3] : std::sin(key[3]) / gyration_m;
  const double psi = raw ? 0 : key[2];
  return {speed * Vec3(std::sin(key[0]), -std::cos(key[0]), 0),
          spin * spin_direction(key[0], key[1], psi)};
}

Vec3 particle_response(const Vec3& velocity, double restitution, double friction) {
  const double normal_impulse = -(1 + restitution) * velocity.y();
  const double sliding = std::hypot(velocity.x(), velocity.z());
  const double kept = sliding > 0 ? std::max(0.0, 1 - friction * normal_impulse / sliding) : 0.0;
  return {kept * velocity.x(), -restitution * velocity.y(), kept * velocity.z()};
}

}  // namespace pilesim
