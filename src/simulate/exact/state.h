// All that the exact engine keeps from one step to the next; plain data.
#pragma once

#include <algorithm>
#include <limits>
#include <span>
#include <vector>

#include "simulate/exact/body.h"
#include "simulate/exact/broad_phase.h"
#include "simulate/exact/pair.h"
#include "simulate/impulse_control.h"

namespace pilesim::exact {

// A joint holds a point alone, all but the turn about an axis, or all.
enum class Holds : uint8_t { point, axis, all };

// A point of a body held at a point of another or of the world.
struct Joint {
  static constexpr ConstraintId kHinge = ~ConstraintId{0};
  static constexpr ConstraintId kFirstOfModel = ConstraintId{1} << 31;
  static constexpr uint32_t kWorld = ~uint32_t{0};

  // kHinge: a hinge of the model; from kFirstOfModel on its joints; below directors' nails and
  // glue.
  ConstraintId id = 0;
  uint32_t a = 0, b = 0;  // bodies; b may be kWorld
  Vec3 point_a, point_b;  // m, in their frames
  Vec3 axis_a, axis_b;    // unit, in their frames
  double breaking_impulse_ns = 0;
  Holds holds = Holds::axis;
  double breaking_force_n = std::numeric_limits<double>::infinity();  // mean of a step
  // For a hinge: limits of b's turn against a, rad; the speed that its motor drives b with against
  // a, rad/s, and its torque.
  double least_turn = -std::numeric_limits<double>::infinity();
  double most_turn = std::numeric_limits<double>::infinity();
  double motor_rad_s = 0, motor_most_nm = 0;
  double motor_nm = 0, limit_nm = 0;  // of the last step, on b, about the axis
  double turn = 0;                    // of b against a, rad, with its whole turns
  // For glue; other joints have no strength and never tear.
  bool is_glue = false;
  Quat attitude = Quat::Identity();  // of b in a's frame, as it is meant
  double strength_n = 0, strength_nm = 0, tears_m = 0, tears_rad = 0;
  Vec3 force_n = Vec3::Zero(), torque_nm = Vec3::Zero();  // of the last step, on b, world

  static void fields(auto& self, auto& stream) {
    stream(self.id, self.a, self.b, self.point_a, self.point_b, self.axis_a, self.axis_b,
           self.breaking_impulse_ns, self.holds, self.breaking_force_n, self.least_turn,
           self.most_turn, self.motor_rad_s, self.motor_most_nm, self.motor_nm, self.limit_nm,
           self.turn, self.is_glue, self.attitude, self.strength_n, self.strength_nm, self.tears_m,
           self.tears_rad, self.force_n, self.torque_nm);
  }
  bool is_of_model() const { return id >= kFirstOfModel; }
  bool drives() const { return motor_most_nm > 0 && motor_rad_s != 0; }
};

// Pairs of bodies that stand still. Their contacts hold until one of the two moves, so that
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
  RestingPairs resting;              // PairList
  std::vector<Joint> joints;         // by id; Engine
  ConstraintId next_nail = 0;        // Engine
  std::vector<ConstraintId> broken;  // joints of the model; StepSolver

  static void fields(auto& self, auto& stream) {
    stream(self.bodies, self.boxes, self.fresh, self.pairs, self.contacts, self.resting,
           self.joints, self.next_nail, self.broken);
  }

  std::span<Contact> contacts_of(const Pair& pair) {
    return std::span(contacts).subspan(pair.first_contact, pair.contact_count);
  }
  std::span<const Contact> contacts_of(const Pair& pair) const {
    return std::span(contacts).subspan(pair.first_contact, pair.contact_count);
  }
};

// The bodies that do not stand still, ascending.
inline void list_active(const EngineState& state, std::vector<uint32_t>& active) {
  active.clear();
  for (uint32_t i = 0; i < state.bodies.size(); ++i) {
    if (!state.bodies[i].stands_still()) active.push_back(i);
  }
}

}  // namespace pilesim::exact
