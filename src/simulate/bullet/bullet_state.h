// What a Bullet world is at a moment: all of its that goes from one step to the next, as plain
// data. Bullet steps objects of its own; BulletEngine::state() reads this from them and set_state()
// makes a world of it that goes on with the same bits. So it has more than motions: the order of
// bodies, of the tree's nodes, of pairs and of contact points decides over the order in which
// contacts are found and solved. What a step makes anew is no part of it. "By" says who writes a
// field.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/state_stream.h"
#include "core/types.h"
#include "simulate/impulse_control.h"

namespace pilesim {

// As Bullet has it, to the last bit: a matrix that has been a rotation to rounding.
struct BulletFrame {
  Mat3 axes = Mat3::Identity();
  Vec3 origin = Vec3::Zero();  // m

  static void fields(auto& self, auto& stream) { stream(self.axes, self.origin); }
};

// How a dynamic body lies, as its contacts in the last step had it.
struct BulletRest {
  Vec3 place = Vec3::Zero();  // m, world: where it was held last, or its rest began; by BulletWorld
  bool supported = false;     // some contact pushed it; this and below by BulletContactSolver
  bool sunk = false;          // some contact was deeper than it may sleep with
  bool sticks = false;        // friction of some contact was below its limit
  int loads = 0;              // contacts that pushed it

  static void fields(auto& self, auto& stream) {
    stream(self.place, self.supported, self.sunk, self.sticks, self.loads);
  }
};

struct BulletBody {
  uint32_t index = 0;         // of the model
  bool held = false;          // dynamic, but stands still until its release; by add()
  bool moved = false;         // kinematic: in the step before; by move_by_keys()
  bool put_to_sleep = false;  // and so static, for Bullet; by put_to_sleep() and wake()
  BulletFrame pose;           // from Bullet's frame of the body to the world; by step()
  // 1/(kg m^2), world. Of the pose of the last step, which is not where nudges have brought the
  // body since; by step().
  Mat3 inverse_inertia = Mat3::Identity();
  Vec3 velocity = Vec3::Zero(), spin = Vec3::Zero();     // m/s, rad/s, world; by step()
  Vec3 box_low = Vec3::Zero(), box_high = Vec3::Zero();  // m, world, tight; by the broad phase
  int proxy_id = 0;                                      // pairs are named by it; by add()
  double root_friction = 0;                              // by set_friction()
  double slow_s = 0;                                     // for how long; by step()
  int activation = 0;                                    // Bullet's; by step(), wake(), ...
  BulletRest rest;                                       // of a dynamic one
  std::optional<std::array<BulletFrame, 2>> hinge;  // in the body's frame and in the world's; add()

  static void fields(auto& self, auto& stream) {
    stream(self.index, self.held, self.moved, self.put_to_sleep, self.pose, self.inverse_inertia,
           self.velocity, self.spin, self.box_low, self.box_high, self.proxy_id, self.root_friction,
           self.slow_s, self.activation, self.rest, self.hinge);
  }
};

// The broad phase's, in pre-order.
struct BulletTree {
  static constexpr uint32_t kInner = ~0U;
  std::vector<uint32_t> leaf;              // (N) the body of the model, or kInner
  std::vector<std::array<double, 6>> box;  // (N) m, world: low and high corner, fat

  static void fields(auto& self, auto& stream) { stream(self.leaf, self.box); }
};

struct BulletNail {
  ConstraintId id = 0;
  uint32_t a = 0, b = 0;           // of the model
  double breaking_impulse_ns = 0;  // of a step
  bool enabled = true;             // false: broken; by step()
  BulletFrame in_a, in_b;          // the slider's frames in Bullet's frames of the bodies

  static void fields(auto& self, auto& stream) {
    stream(self.id, self.a, self.b, self.breaking_impulse_ns, self.enabled, self.in_a, self.in_b);
  }
};

// A place in BulletState::manifolds, or none.
inline constexpr uint32_t kNoManifold = ~0U;

// Two convex pieces that may meet; by PieceCollisionAlgorithm.
struct BulletPiecePair {
  uint32_t a = 0, b = 0;      // pieces of the two bodies
  Vec3 apart = Vec3::Zero();  // from b to a in the frame of body a, any length; 0: not known
  double slack_m = 0;         // motion until they may come within reach
  uint32_t manifold = kNoManifold;

  static void fields(auto& self, auto& stream) {
    stream(self.a, self.b, self.apart, self.slack_m, self.manifold);
  }
};

// Which algorithm looks for the contacts of two bodies.
enum class BulletAlgorithm : uint8_t { none, pieces, plane, compound, stock };

// Two bodies whose fat boxes meet, and what their algorithm keeps.
struct BulletPair {
  uint32_t a = 0, b = 0;  // of the model
  BulletAlgorithm algorithm = BulletAlgorithm::none;
  // Pieces:
  BulletFrame b_from_a;                 // in the step before
  double list_slack_m = 0;              // motion until `pieces` may miss one
  std::vector<BulletPiecePair> pieces;  // by a, then b
  // Plane, stock: places in BulletState::manifolds. A plane has one or none.
  std::vector<uint32_t> manifolds;
  // Compound: the same for each child that has an algorithm.
  std::vector<std::optional<std::vector<uint32_t>>> children;

  static void fields(auto& self, auto& stream) {
    stream(self.a, self.b, self.algorithm);
    if (self.algorithm == BulletAlgorithm::pieces) {
      stream(self.b_from_a, self.list_slack_m, self.pieces);
    } else if (self.algorithm == BulletAlgorithm::compound) {
      stream(self.children);
    } else if (self.algorithm != BulletAlgorithm::none) {
      stream(self.manifolds);
    }
  }
};

// A contact point; by the algorithms when they find it, impulses by the solver.
struct BulletContact {
  Vec3 local_a, local_b;       // m, in Bullet's frames of the two bodies
  Vec3 on_b, on_a;             // m, world
  Vec3 normal;                 // unit, world, from b to a
  Vec3 friction_direction[2];  // unit, world
  double distance_m = 0;       // < 0: sunk
  double friction = 0, rolling_friction = 0, spinning_friction = 0, restitution = 0;
  int part[2] = {}, index[2] = {};     // of the shapes' features
  int flags = 0;                       // Bullet's
  double impulse_ns = 0;               // of the last step, for the warm start
  double former_right_side = 0;        // m/s
  double friction_impulse_ns[2] = {};  // along friction_direction
  double friction_motion_m_s[2] = {};  // wanted along it
  double contact_cfm = 0, contact_erp = 0, friction_cfm = 0;  // Bullet's softness; not used
  int age_steps = 0;

  static void fields(auto& self, auto& stream) {
    stream(self.local_a, self.local_b, self.on_b, self.on_a, self.normal,
           self.friction_direction[0], self.friction_direction[1], self.distance_m, self.friction,
           self.rolling_friction, self.spinning_friction, self.restitution, self.part[0],
           self.part[1], self.index[0], self.index[1], self.flags, self.impulse_ns,
           self.former_right_side, self.friction_impulse_ns[0], self.friction_impulse_ns[1],
           self.friction_motion_m_s[0], self.friction_motion_m_s[1], self.contact_cfm,
           self.contact_erp, self.friction_cfm, self.age_steps);
  }
};

struct BulletState {
  std::vector<BulletBody> bodies;  // those in the world, in its order; by add() and remove()
  std::vector<uint32_t> movable;   // of them, those that are not static, in the order of a step
  BulletTree tree;                 // with a leaf for each of them; by the broad phase
  int last_proxy_id = 0;           // given; by add()
  bool has_parted = false;         // a box has moved since parted pairs were dropped
  std::vector<BulletPair> pairs;   // in the order in which contacts are found; by the broad phase
  std::vector<std::vector<BulletContact>> manifolds;  // in the order in which they are solved
  std::vector<BulletNail> nails;                      // by id; by add_nail()
  ConstraintId next_nail = 0;
  // In the order in which they are solved: hinges as their bodies, nails as their id above those.
  std::vector<uint64_t> constraints;
  bool friction_changed = false;  // since the last step; by set_friction()

  static void fields(auto& self, auto& stream) {
    stream(self.bodies, self.movable, self.tree, self.last_proxy_id, self.has_parted, self.pairs,
           self.manifolds, self.nails, self.next_nail, self.constraints, self.friction_changed);
  }
};

}  // namespace pilesim
