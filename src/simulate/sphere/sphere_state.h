// The state of the sphere engine: everything that persists between steps and that checkpoints
// contain. Plain data; sphere_step.h has the scratch of a step. (B): by body of the model.
#pragma once

#include <cstdint>
#include <vector>

#include "core/state_stream.h"
#include "simulate/sphere/contact_groups.h"
#include "simulate/sphere/rest_control.h"

namespace pilesim {

// A dynamic body that was added to the model. It fills a cache line, since a step reads and writes
// bodies in the order of the grid.
struct alignas(64) SphereBody {
  static constexpr bool kStoredAsItLies = true;
  static constexpr uint8_t kNoTarget = kMostRestTargets;
  static constexpr uint32_t kKeepsNone = ~0U;
  Quatf orientation = Quatf::Identity();  // body to world
  Vec3f position = Vec3f::Zero();         // m, world
  Vec3f velocity = Vec3f::Zero();         // m/s
  Vec3f spin = Vec3f::Zero();             // rad/s
  float surface_radius_m = 0;             // radius of the sphere when it rests on a surface
  uint32_t kept = kKeepsNone;             // index of its last stored impulse, or none
  uint16_t slow_steps = 0;                // time for which it has hardly moved
  uint8_t rest_target = kNoTarget;        // the pose to which it turns
  uint8_t : 0;                            // threads write the fields above and read those below
  bool asleep : 1 = false;
  bool still : 1 = false;    // is among the sleepers
  bool changed : 1 = false;  // set by the world, cleared by the reader of the state
  // Another engine moves it as well and sets surface_radius_m in each step.
  bool shared : 1 = false;
  // Supported by a body that is neither sphere nor surface: keeps its pose.
  bool propped : 1 = false;
  bool put_to_sleep : 1 = false;  // from outside: touches do not wake it
  bool block : 1 = false;         // of a structure: touches other blocks by faces; see face_patch.h
  uint8_t spare : 1 = 0;          // makes all bits defined
};
static_assert(sizeof(SphereBody) == 64);

// Impulse of a contact in the previous step.
struct KeptImpulse {
  static constexpr bool kStoredAsItLies = true;
  static constexpr uint32_t kLast = ~0U;
  uint32_t other = 0;     // a body, or with kSurface a surface of it
  uint32_t next = kLast;  // the previous one of the same body
  Vec3f normal = Vec3f::Zero();
  ContactImpulse impulse;
};
static_assert(sizeof(KeptImpulse) == 48);

// Flag in the index of a touched body: one of its surfaces, not a sphere.
inline constexpr uint32_t kSurface = 0x80000000;

// The spheres and places from which a grid of sleepers was sorted; since then some may have woken
// or been removed.
struct SleeperSpheres {
  std::vector<uint32_t> body;
  std::vector<Vec3f> centre;   // m, parallel to body
  std::vector<float> reach_m;  // parallel to body

  static void fields(auto& self, auto& stream) { stream(self.body, self.centre, self.reach_m); }
};

struct SphereState {
  uint64_t steps = 0;                // number of steps begun; written by SphereWorld
  std::vector<SphereBody> bodies;    // (B) written by all stages
  std::vector<float> radius_m;       // (B) among bodies, written by the stage of rest
  std::vector<float> root_friction;  // (B) replaces that of the kind; empty until set_friction()
  std::vector<KeptImpulse> kept;     // written by the solver, for the next step's search
  std::vector<uint32_t> members;     // bodies in the world, ascending
  std::vector<uint32_t> active;      // members in the grid of the awake, ascending
  std::vector<uint32_t> woken;       // members about to become active
  SleeperSpheres sleepers;           // the others, written by SphereSleepers
  SleeperSpheres active_sleepers;    // active sleepers, only of structures
  bool are_active_sleepers_sorted = false;  // in this step
  uint64_t waiting_for_sleep = 0;           // sleepers among the active, summed over steps
  // From the last step with an awake body: number of loaded contacts, and the penetration depth.
  uint32_t contacts = 0;
  float deepest_m = 0;

  static void fields(auto& self, auto& stream) {
    stream(self.steps, self.bodies, self.radius_m, self.root_friction, self.kept, self.members,
           self.active, self.woken, self.sleepers, self.active_sleepers,
           self.are_active_sleepers_sorted, self.waiting_for_sleep, self.contacts, self.deepest_m);
  }
};

}  // namespace pilesim
