// Can a whole pile stand? Solves for the contact forces of all bodies at once, each on both its
// bodies (Whiting 2012; dissertation 2.25 to 2.28 with exact cones). A pile that the local rule
// (equilibrium.h) calls stable may still fall as a whole. A pile that stands as a whole is locally
// stable at all its contacts, since the forces are the same.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/types.h"

namespace pilesim {

struct PileBody {
  Vec3 centre;      // of mass, m
  double radius_m;  // > 0, about the centre
  double mass_kg;   // 0: fixed
};

struct PileContact {
  uint32_t a, b;    // indices of bodies
  Vec3 position;    // m
  Vec3 normal;      // unit, from b towards a
  double friction;  // >= 0
};

struct PileEquilibriumSettings {
  double tolerance = 1e-3;  // of a body's residual, in its weight
  int most_sweeps = 20000;
};

struct PileVerdict {
  enum class Kind {
    stable,     // `force` balances each body within the tolerance
    unstable,   // `push` and `turn` are a motion that gravity drives and no contact resists
    undecided,  // neither was reached
  } kind = Kind::undecided;
  double unbalanced = 0;  // largest of any body, in its weight
  // As in EquilibriumVerdict, over all contacts, relative to the size of the motion.
  double resistance = 0;
  int sweeps = 0;
  std::vector<Vec3> force;       // (contacts) N over g, on a, world frame
  std::vector<Vec3> push, turn;  // (bodies) residual: force / (m g), torque / (m g r)
};

// Accelerated projected gradients on the sum of squared residuals, in g: the least constraint of
// Gauss's principle, with r as the radius of gyration.
PileVerdict analyse_pile(std::span<const PileBody> bodies, std::span<const PileContact> contacts,
                         const Vec3& up, const PileEquilibriumSettings& settings = {});

}  // namespace pilesim
