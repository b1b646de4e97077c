// Judges the soundness of a pile by exact distances of collision shapes, independent of any
// simulator.
#pragma once

#include <vector>

#include "core/pile_quality.h"
#include "model/model.h"
#include "simulate/body_state.h"

namespace pilesim {

// A body at rest sleeps, or its centre, and its rim by turning, are slower than this share of
// sqrt(g r), where r is its bounding radius.
inline constexpr double kRestingSpeed = 0.05;
// It is not at rest if its centre has crept faster than this share of sqrt(g r) over some time:
// 0.003 r in kQuietTime. No engine would let such a body sleep.
inline constexpr double kCreepingSpeed = 0.001;
// The time of kCreepingSpeed, in sqrt(r / g): a body slow for this long is not at the top of a
// bounce.
inline constexpr double kQuietTime = 3;
// Bodies closer than this share of the mean diameter hold each other up.
inline constexpr double kTouchingGap = 0.02;

// Positions of the bodies some time earlier.
struct EarlierPlaces {
  double ago_s = 0;            // 0: unknown, and ignored
  std::vector<Vec3> position;  // (bodies) m
  std::vector<uint8_t> flags;  // (bodies)
};

// kQuietTime for the largest body that can move, s; 0 without gravity.
double quiet_time_s(const Model& model, const Vec3& gravity);

// Distances are exact and between the model's collision pieces, for pairs whose boxes nearly touch;
// margins of engines play no part. Another model with shapes closer to the meshes may judge the
// same states. A body has escaped through a plane if its centre is deeper behind the plane than its
// smallest extent. A body floats if it is at rest and no chain of touching bodies joins it to one
// that is static, kinematic, fixed, hinged, jointed or moving. Bodies that a joint excludes from
// contact are not tested against each other. `gravity` in m/s^2. Runs in parallel; the result does
// not depend on the number of threads.
PileQuality inspect_pile(const Model& model, const Vec3& gravity, const BodyStates& states,
                         const EarlierPlaces& earlier = {});

// (bodies) Largest penetration depth of each body, m, by the same distances; 0 where it penetrates
// none. At least one body of a pair is dynamic and released. Runs in parallel, as above.
std::vector<double> overlap_depths(const Model& model, const BodyStates& states);

// Number of bodies not at rest: PileQuality::unsettled alone, which needs no distances.
uint64_t count_unsettled(const Model& model, const Vec3& gravity, const BodyStates& states,
                         const EarlierPlaces& earlier = {});

}  // namespace pilesim
