#include "simulate/rolling_resistance.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "core/error.h"

namespace pilesim {
namespace {

bool resists(const Material& material) {
  return material.rolling_friction > 0 || material.spinning_friction > 0;
}

}  // namespace

RollingResistance::RollingResistance(const Model& model) {
  if (std::ranges::none_of(model.materials, resists)) return;
  bodies_.reserve(model.bodies.size());
  for (const ModelBody& body : model.bodies) {
    const Material& material = model.materials[body.material];
    const double volume_m3 = model.shapes[body.shape].mass.volume_m3;
    bodies_.push_back({std::sqrt(material.rolling_friction), std::sqrt(material.spinning_friction),
                       body.role == Role::dynamic ? std::cbrt(3 * volume_m3 / (4 * kPi))
                                                  : std::numeric_limits<double>::infinity()});
  }
}

TorqueArms RollingResistance::between(uint32_t a, uint32_t b) const {
  if (is_none()) return {};
  const OfBody &of_a = bodies_[a], &of_b = bodies_[b];
  const double radius = std::min(of_a.radius_m, of_b.radius_m);
  if (!std::isfinite(radius)) return {};
  return {of_a.root_rolling * of_b.root_rolling * radius,
          of_a.root_spinning * of_b.root_spinning * radius};
}

void refuse_rolling_friction(const Model& model,
                             const std::function<bool(const ModelBody&)>& is_sphere) {
  for (const ModelBody& body : model.bodies) {
    if (body.role != Role::dynamic || !is_sphere(body)) continue;
    const Material& material = model.materials[body.material];
    if (!resists(material)) continue;
    const char* key = material.rolling_friction > 0 ? "rolling_friction" : "spinning_friction";
    throw Error(ErrorKind::input,
                {.found = "'" + body.name + "' is a sphere of a material with " + key,
                 .expected = "spheres of materials without, which have the rolling resistance of "
                             "their mode",
                 .remedy = "Take the key away, or let contacts be solved: /simulator/mode impulse, "
                           "in the mixed mode \"preference\": \"must_impulse\""});
  }
}

}  // namespace pilesim
