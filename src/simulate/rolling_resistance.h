// Torques by which contacts hold back rolling and spinning: how far they go, for every exact
// engine.
//
// A contact that pushes with a force F along its normal holds back the turning of one body against
// the other with a torque of up to rolling_m F across the normal and spinning_m F along it. As
// Coulomb's friction it opposes the turning while there is any, whatever its speed, and holds
// bodies that do not turn. The limits of the points of a pair add up, as their forces do.
//
// A material's coefficients are pure numbers, as those of particles are (Ai et al., "Assessment of
// rolling resistance models in discrete element simulations", 2011, model A): the length is the
// coefficient times a radius. So a ball stays where it is on slopes of up to atan(coefficient),
// however large it is. Chrono, MuJoCo and Bullet ask for the length.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "model/model.h"

namespace pilesim {

// Torque arms of a pair of bodies: the torque for a force, m.
struct TorqueArms {
  double rolling_m = 0, spinning_m = 0;
};

class RollingResistance {
 public:
  explicit RollingResistance(const Model& model);

  // No two bodies have any.
  bool is_none() const { return bodies_.empty(); }
  // For two bodies by their indices in the model: the square root of the product of their
  // materials' coefficients, times the radius of the smaller one.
  TorqueArms between(uint32_t a, uint32_t b) const;

 private:
  struct OfBody {
    double root_rolling, root_spinning;
    double radius_m;  // of a ball of its volume; infinite where contacts never move it
  };
  std::vector<OfBody> bodies_;
};

// Spheres that stand for bodies have a rolling resistance of their own: throws Error(input) if the
// material of a dynamic body that `is_sphere` has coefficients.
void refuse_rolling_friction(const Model& model,
                             const std::function<bool(const ModelBody&)>& is_sphere);

}  // namespace pilesim
