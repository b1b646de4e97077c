// How sound a pile is, by the distances of its bodies' collision shapes, whatever simulated it.
#pragma once

#include <vector>

#include "core/pile_quality.h"
#include "model/model.h"
#include "simulate/body_state.h"

namespace pilesim {

// A body at rest sleeps, or is slower than this share of sqrt(g r) in its centre and, by turning,
// at its outer radius r.
inline constexpr double kRestingSpeed = 0.05;
// Nor is it at rest where its centre has crept faster than this share of sqrt(g r) over some time:
// by 0.003 r in the time that it must be quiet, beyond which no engine lets it sleep.
inline constexpr double kCreepingSpeed = 0.001;
// That time, in sqrt(r / g): a body that is slow for so long is not at the top of a bounce.
inline constexpr double kQuietTime = 3;
// Bodies closer than this share of the mean diameter hold each other up.
inline constexpr double kTouchingGap = 0.02;

// Where bodies were some time before.
struct EarlierPlaces {
  double ago_s = 0;            // 0: not known, and nobody is judged by it
  std::vector<Vec3> position;  // (bodies) m
  std::vector<uint8_t> flags;  // (bodies)
};

// For the largest body that is free to move, s; 0 without gravity.
double quiet_time_s(const Model& model, const Vec3& gravity);

// Distances are those of the model's collision pieces, exact, for pairs whose boxes nearly meet; no
// engine and no skin of one has a part in them. The same states may be judged by another model
// whose shapes follow the meshes more closely. Bodies escape through a plane when their centre is
// deeper behind it than their smallest extent. Floating are bodies at rest that no chain of
// touching bodies joins to one that is fixed, kinematic, held, hinged, jointed or moving. Bodies
// that are kept apart by a joint are not judged against each other. `gravity` in
// m/s^2. Runs in parallel; the result does not depend on the number of threads.
PileQuality inspect_pile(const Model& model, const Vec3& gravity, const BodyStates& states,
                         const EarlierPlaces& earlier = {});

// (bodies) Penetration depth of each body, at its deepest pair, m, by the same distances; 0 where
// it penetrates none. At least one body of a pair is dynamic and released. Runs in parallel, as
// above.
std::vector<double> overlap_depths(const Model& model, const BodyStates& states);

// The bodies that are not at rest: PileQuality::unsettled alone, which needs no distances.
uint64_t count_unsettled(const Model& model, const Vec3& gravity, const BodyStates& states,
                         const EarlierPlaces& earlier = {});

}  // namespace pilesim
