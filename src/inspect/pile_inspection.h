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
// Bodies closer than this share of the mean diameter hold each other up.
inline constexpr double kTouchingGap = 0.02;

// Distances are those of the model's collision pieces, exact, for pairs whose boxes nearly meet; no
// engine and no skin of one has a part in them. The same states may be judged by another model
// whose shapes follow the meshes more closely. Bodies escape through a plane when their centre is
// deeper behind it than their smallest extent. Floating are bodies at rest that no chain of
// touching bodies joins to one that is fixed, kinematic, held, hinged or moving. `gravity` in
// m/s^2. Runs in parallel; the result does not depend on the number of threads.
PileQuality inspect_pile(const Model& model, const Vec3& gravity, const BodyStates& states);

// (bodies) How deep each is in the one that it is deepest in, m, by the same distances; 0 where it
// is in none. Of two bodies one at least is dynamic and let go. Runs in parallel, as above.
std::vector<double> overlap_depths(const Model& model, const BodyStates& states);

// The bodies that are not at rest: PileQuality::unsettled alone, which needs no distances.
uint64_t count_unsettled(const Model& model, const Vec3& gravity, const BodyStates& states);

}  // namespace pilesim
