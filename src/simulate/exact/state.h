// All that the exact engine keeps from one step to the next; plain data.
#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "simulate/exact/body.h"
#include "simulate/exact/broad_phase.h"
#include "simulate/exact/pair.h"
#include "simulate/impulse_control.h"

namespace pilesim::exact {

// A point of a body held at a point of another or of the world, about an axis that is free, or, of
// glue, about none.
struct Joint {
  static constexpr ConstraintId kHinge = ~ConstraintId{0};
  static constexpr uint32_t kWorld = ~uint32_t{0};

  ConstraintId id = 0;    // kHinge: the model's own
  uint32_t a = 0, b = 0;  // bodies; b may be kWorld
  Vec3 point_a, point_b;  // m, in their frames
  Vec3 axis_a, axis_b;    // unit, in their frames
  double breaking_impulse_ns = 0;
  // For glue; other joints have no strength and never tear.
  bool is_glue = false;
  Quat attitude = Quat::Identity();  // of b in a's frame
  double strength_n = 0, strength_nm = 0, tears_m = 0, tears_rad = 0;
  Vec3 force_n = Vec3::Zero(), torque_nm = Vec3::Zero();  // of the last step, on b, world

  static void fields(auto& self, auto& stream) {
    stream(self.id, self.a, self.b, self.point_a, self.point_b, self.axis_a, self.axis_b,
           self.breaking_impulse_ns, self.is_glue, self.attitude, self.strength_n, self.strength_nm,
           self.tears_m, self.tears_rad, self.force_n, self.torque_nm);
  }
};

// Pairs of bodies that stand still. What is found of them holds until one of the two moves, so that
// steps pass them by.
struct RestingPairs {
  std::vector<Pair> pairs;        // by key
  std::vector<Contact> contacts;  // of theirs

  static void fields(auto& self, auto& stream) { stream(self.pairs, self.contacts); }
  std::span<const Contact> contacts_of(const Pair& pair) const {
    return std::span(contacts).subspan(pair.first_contact, pair.contact_count);
  }
};

// Contacts that touch or push.
struct ContactCount {
  uint32_t count = 0;
  float deepest_m = 0;  // overlap

  void add(std::span<const Contact> contacts) {
    for (const Contact& contact : contacts) {
      if (contact.distance_m > 0 && contact.normal_force_n <= 0) continue;
      ++count;
      deepest_m = std::max(deepest_m, -contact.distance_m);
    }
  }
};

struct EngineState {
  std::vector<Body> bodies;     // (B) written by Engine
  std::vector<WideBox> boxes;   // (B) m, world, wider than the body; PairList
  std::vector<uint32_t> fresh;  // bodies that have come since the last step; PairList
  // By key, but for those that rest; PairList makes them, NarrowPhase keeps them.
  std::vector<Pair> pairs;
  // By pairs; NarrowPhase finds them, StepSolver writes their forces.
  std::vector<Contact> contacts;
  RestingPairs resting;        // PairList
  std::vector<Joint> joints;   // nails and glue by id, then hinges; Engine
  ConstraintId next_nail = 0;  // Engine

  static void fields(auto& self, auto& stream) {
    stream(self.bodies, self.boxes, self.fresh, self.pairs, self.contacts, self.resting,
           self.joints, self.next_nail);
  }

  std::span<Contact> contacts_of(const Pair& pair) {
    return std::span(contacts).subspan(pair.first_contact, pair.contact_count);
  }
  std::span<const Contact> contacts_of(const Pair& pair) const {
    return std::span(contacts).subspan(pair.first_contact, pair.contact_count);
  }
};

}  // namespace pilesim::exact
