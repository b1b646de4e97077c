// Which bodies rest, sleep and wake. Bodies that touch each other are an island: they fall asleep
// together, when all of them have been at rest for long enough, and what touches something awake
// wakes.
#pragma once

#include <span>
#include <vector>

#include "core/disjoint_sets.h"
#include "simulate/exact/state.h"
#include "simulate/exact/throws.h"

namespace pilesim::exact {

class Rest {
 public:
  // Works on the bodies, pairs and joints of `state`; `active`: the bodies that do not stand still.
  // All must outlive it.
  Rest(const Model& model, std::span<const CollisionShape> shapes, EngineState& state,
       const std::vector<uint32_t>& active, const Vec3& gravity);

  // Wakes bodies that began asleep at a motor or near a surface that runs, before contacts are
  // found: none of theirs are known yet. Whether anything was woken. Asked once others have come.
  bool wake_driven();
  // With the contacts of a step of `step_s`, which the pairs `touching` have; sleeping bodies are
  // in the way of those that impacts throw at them. Whether anything was woken.
  bool wake_islands(double step_s, std::span<const uint32_t> touching, const Throws& throws);
  // A joint, or the partner while contacts are solved, carries the body.
  void carry(uint32_t body);
  // Once they are solved.
  void note_support(std::span<const uint32_t> touching);
  // Counts the time for which bodies have rested; islands fall asleep if they `may_sleep`.
  void end_step(bool may_sleep);

 private:
  // The contacts of a pair, or of a body, in a step.
  struct Load {
    int count = 0;        // of those that pushed
    float depth_m = 0;    // of the deepest of them
    bool sticks = false;  // friction of one of them was below its limit
  };
  enum class Link : uint8_t { none, both, a_on_b, b_on_a };  // on: on a surface that moves
  struct BodyConstants {
    double rest_speed = 0, time_to_sleep_s = 0, rest_drift_m = 0, held_drift_m = 0,
           rest_depth_m = 0, wedged_depth_m = 0;
    Vec3 rest_reach = Vec3::Zero();  // m, principal axes: speeds of the rim for 1 rad/s
  };
  bool touches(const Pair& pair, std::span<const Contact> contacts, const Throws& throws) const;
  bool joins(uint32_t body) const;
  void link(uint32_t a, uint32_t b);
  void carry_along(uint32_t body);
  bool wake_linked();
  void count_rest(uint32_t body);

  std::span<const CollisionShape> shapes_;
  EngineState& state_;
  std::vector<Body>& bodies_;
  const std::vector<uint32_t>& active_;
  double step_s_ = 0;  // of the step under way
  std::vector<BodyConstants> constants_;
  std::vector<uint8_t> runs_;  // bodies with a surface velocity
  // Scratch of a step.
  DisjointSets islands_;
  std::vector<Load> supports_;    // of bodies
  std::vector<Link> links_;       // of pairs that touch
  std::vector<Load> loads_;       // and of these
  std::vector<uint8_t> carried_;  // bodies on a surface that moves
  std::vector<uint32_t> linked_;  // those, and bodies that are of an island with others
};

}  // namespace pilesim::exact
