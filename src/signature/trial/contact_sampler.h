// Trials: a body that flies freely into a plane, at the moment it touches, and what comes of it.
//
// The body is launched out of reach of the plane in a random orientation with a velocity and a
// spin. A freely turning body precesses, so the spin at contact is another one: the result tells
// it, because that is what a simulator knows.
//
// To have exactly a given spin AT CONTACT, which costs many times more, the trial can start there.
// The distribution of the orientation is the one in a uniform stream of bodies of every orientation
// and spin (uniform in phase space, which free motion preserves): an orientation occurs at contact
// in proportion to the speed at which the lowest vertex approaches the plane, if the body could get
// there without touching before. So a candidate orientation is drawn uniformly, kept in proportion
// to its approach speed, and flown backwards in time: if it touches on the way, it is dropped.
// Exactly the fraction contact_acceptance() of the candidates is kept in the mean.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/types.h"
#include "signature/trial/contact_body.h"

namespace pilesim {

enum class TrialKind {
  height,  // up to the contact only
  micro,   // one impact
  macro,   // flight and impacts until the body leaves the plane
};

// Around which axis the spin is turned at random, for every candidate by itself.
enum class SpinSpread {
  fixed,      // not at all
  cone,       // around the velocity: the cone of the dissertation's Figure 3.3
  ring,       // around the plane's normal
  everywhere  // any direction
};

enum class TrialStart {
  launch,   // velocity and spin are those of the launch; every candidate is kept
  contact,  // at contact; only the fraction contact_acceptance() of the candidates is kept
};

// Candidates [first, first + count) of one collision configuration. World axes: y is the plane's
// normal, velocity.y < 0.
struct TrialRequest {
  Vec3 velocity;  // m/s
  Vec3 spin;      // rad/s
  TrialStart start = TrialStart::contact;
  SpinSpread spread = SpinSpread::fixed;
  uint64_t object = 0;  // names the random sequence; requests with equal objects repeat each other
  uint32_t first = 0;
  uint32_t count = 0;
};

struct TrialResult {
  bool kept = false;                // else the rest means nothing
  bool unsettled = false;           // stopped after kMostImpacts: v_n is set to 0 if it was below
  uint16_t impacts = 0;             // 0 for TrialKind::height
  double height_m = 0;              // of the centre of mass at the first contact
  Vec3 spin_before = Vec3::Zero();  // at contact
  Vec3 velocity = Vec3::Zero();     // m/s, after the last impact
  Vec3 spin = Vec3::Zero();         // rad/s, after the last impact
};
inline constexpr int kMostImpacts = 1000;

// The meaning of the spins of requests and results, both in world axes.
enum class SpinMeasure {
  angular_velocity,
  // k^-1 I^(1/2) w: of a ball of the body's radius of gyration k that turns with the same energy,
  // about the same axis where that is a principal one. A long body that is hit beside its axis
  // spins fast about it with little energy: by angular velocities these collisions would look like
  // those that make it tumble.
  energy,
};

struct TrialSetup {
  const ContactBody* body;
  ContactMaterial material;
  TrialKind kind = TrialKind::macro;
  uint64_t seed = 1;
  SpinMeasure spins = SpinMeasure::angular_velocity;
};

// The mean fraction of candidates that are kept, in (0, 1], of a request that starts at contact.
double contact_acceptance(const TrialSetup& setup, const TrialRequest& request);

// The number of candidates that keeps `trials` of them in the mean.
uint32_t candidates_for(const TrialSetup& setup, const TrialRequest& request, uint32_t trials);

// One result a candidate, in the order of requests and candidates. Runs on the calling thread. A
// result depends on the setup, the request's configuration and the candidate's number only.
void run_trials(const TrialSetup& setup, std::span<const TrialRequest> requests,
                std::vector<TrialResult>& results);

}  // namespace pilesim
