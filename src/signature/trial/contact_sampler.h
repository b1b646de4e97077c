// Trials: a body flies freely into a plane; the trial records the contact and the response.
//
// The body is launched out of reach of the plane in a random orientation with a velocity and a
// spin. A freely turning body precesses, so its spin changes before the contact. The result states
// the spin at contact, because a simulator knows that one.
//
// The trial can also start at the contact with a given spin, which costs many times more. Its
// orientations are distributed as in a uniform stream of bodies of every orientation and spin
// (uniform in phase space, which free motion preserves). There, an orientation occurs at contact in
// proportion to the speed at which the lowest vertex approaches the plane, provided that the body
// reaches it without an earlier touch. So a candidate orientation is sampled uniformly, accepted in
// proportion to its approach speed, flown backwards in time, and dropped if it touches on the way.
// The mean share of accepted candidates is exactly contact_acceptance().
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/types.h"
#include "signature/trial/contact_body.h"

namespace pilesim {

enum class TrialKind {
  height,  // only up to the contact
  micro,   // one impact
  macro,   // flight and impacts until the body leaves the plane
};

// The random rotation of the spin, independent for every candidate.
enum class SpinSpread {
  fixed,      // none
  cone,       // about the velocity: the cone of the dissertation's Figure 3.3
  ring,       // about the plane's normal
  everywhere  // any direction
};

enum class TrialStart {
  launch,   // velocity and spin apply at launch; every candidate is accepted
  contact,  // they apply at contact; the share contact_acceptance() of the candidates is accepted
};

// Candidates [first, first + count) of one collision configuration. World axes: y is the plane's
// normal, velocity.y < 0.
struct TrialRequest {
  Vec3 velocity;  // m/s
  Vec3 spin;      // rad/s
  TrialStart start = TrialStart::contact;
  SpinSpread spread = SpinSpread::fixed;
  uint64_t object = 0;  // selects the random sequence; requests with equal objects share it
  uint32_t first = 0;
  uint32_t count = 0;
};

struct TrialResult {
  bool kept = false;       // false: the other fields are undefined
  bool unsettled = false;  // stopped after kMostImpacts; v_n is set to 0 if it was negative
  uint16_t impacts = 0;    // 0 for TrialKind::height
  double height_m = 0;     // of the centre of mass, at the first contact
  Vec3 spin_before = Vec3::Zero();  // at contact
  Vec3 velocity = Vec3::Zero();     // m/s, after the last impact
  Vec3 spin = Vec3::Zero();         // rad/s, after the last impact
};
inline constexpr int kMostImpacts = 1000;

// The measure of the spins in requests and results, in world axes.
enum class SpinMeasure {
  angular_velocity,
  // k^-1 I^(1/2) w: the spin of a ball with radius of gyration k and the same energy, about the
  // same axis where that is a principal one. A long body hit beside its axis spins fast about it
  // with little energy: by angular velocity such a collision would look like one that makes it
  // tumble.
  energy,
};

struct TrialSetup {
  const ContactBody* body;
  ContactMaterial material;
  TrialKind kind = TrialKind::macro;
  uint64_t seed = 1;
  SpinMeasure spins = SpinMeasure::angular_velocity;
};

// Mean share of accepted candidates, in (0, 1], for a request that starts at contact.
double contact_acceptance(const TrialSetup& setup, const TrialRequest& request);

// Number of candidates of which `trials` are accepted on average.
uint32_t candidates_for(const TrialSetup& setup, const TrialRequest& request, uint32_t trials);

// One result per candidate, in the order of requests and candidates. Runs on the calling thread. A
// result depends only on the setup, the request's configuration and the candidate's number.
void run_trials(const TrialSetup& setup, std::span<const TrialRequest> requests,
                std::vector<TrialResult>& results);

}  // namespace pilesim
