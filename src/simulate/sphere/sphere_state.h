// The state of the engine of spheres: all that goes from one step to the next, and that checkpoints
// hold. Plain data; the scratch of a step is in sphere_step.h. (B): by body of the model.
#pragma once

#include <cstdint>
#include <vector>

#include "core/state_stream.h"
#include "simulate/sphere/contact_groups.h"
#include "simulate/sphere/rest_control.h"

namespace pilesim {

// A body of the model, dynamic ones that were added. A cache line: a step reads and writes them in
// the order of the grid.
struct alignas(64) SphereBody {
  static constexpr bool kStoredAsItLies = true;
  static constexpr uint8_t kNoTarget = kMostRestTargets;
  static constexpr uint32_t kKeepsNone = ~0U;
  Quatf orientation = Quatf::Identity();  // body to world
  Vec3f position = Vec3f::Zero();         // m, world
  Vec3f velocity = Vec3f::Zero();         // m/s
  Vec3f spin = Vec3f::Zero();             // rad/s
  float surface_radius_m = 0;             // of the sphere where it lies on a surface
  uint32_t kept = kKeepsNone;             // the last of the impulses that it keeps, or none
  uint16_t slow_steps = 0;                // for how long it has hardly moved
  uint8_t rest_target = kNoTarget;        // to which it turns
  uint8_t : 0;                            // threads write those above and read those below
  bool asleep : 1 = false;
  bool still : 1 = false;    // lies among the sleepers
  bool changed : 1 = false;  // set by the world, cleared by who reads the state
  // By another engine that moves it too: surface_radius_m is given in each step.
  bool shared : 1 = false;
  bool propped : 1 = false;       // by a body that is no sphere and no surface: it keeps its pose
  bool put_to_sleep : 1 = false;  // from outside: no touch wakes it
  bool block : 1 = false;         // of a structure: lies on its like by faces; see face_patch.h
  uint8_t spare : 1 = 0;          // so that all bits are known
};
static_assert(sizeof(SphereBody) == 64);

// Impulse of a contact in the step before.
struct KeptImpulse {
  static constexpr bool kStoredAsItLies = true;
  static constexpr uint32_t kLast = ~0U;
  uint32_t other = 0;     // body, or a surface of it: kSurface
  uint32_t next = kLast;  // the one of the same body before this one
  Vec3f normal = Vec3f::Zero();
  ContactImpulse impulse;
};
static_assert(sizeof(KeptImpulse) == 48);

// Set in the index of what a sphere touches: a surface of that body, no sphere.
inline constexpr uint32_t kSurface = 0x80000000;

// The spheres from which a grid of sleepers was sorted, in their places of then; some may have
// woken up since, or were removed.
struct LaidSpheres {
  std::vector<uint32_t> body;
  std::vector<Vec3f> centre;   // m, beside body
  std::vector<float> reach_m;  // beside body

  static void fields(auto& self, auto& stream) { stream(self.body, self.centre, self.reach_m); }
};

struct SphereState {
  uint64_t steps = 0;                // begun; written by SphereWorld
  std::vector<SphereBody> bodies;    // (B) by all stages
  std::vector<float> radius_m;       // (B) among bodies, by the stage of rest
  std::vector<float> root_friction;  // (B) in place of its kind's; empty until set_friction()
  std::vector<KeptImpulse> kept;     // by the solver, for the search of the next step
  std::vector<uint32_t> members;     // bodies in the world, ascending
  std::vector<uint32_t> active;      // of them, those in the grid of the awake, ascending
  std::vector<uint32_t> woken;       // of them, those to become active
  LaidSpheres sleepers;              // the others, by SphereSleepers
  LaidSpheres dozing;                // active ones that sleep, of structures only
  bool is_dozing_sorted = false;     // in this step
  uint64_t waiting_for_sleep = 0;    // sleepers among the active, summed over steps
  // From the last step in which a body was awake: loaded contacts, and the penetration depth.
  uint32_t contacts = 0;
  float deepest_m = 0;

  static void fields(auto& self, auto& stream) {
    stream(self.steps, self.bodies, self.radius_m, self.root_friction, self.kept, self.members,
           self.active, self.woken, self.sleepers, self.dozing, self.is_dozing_sorted,
           self.waiting_for_sleep, self.contacts, self.deepest_m);
  }
};

}  // namespace pilesim
