// Two bodies whose boxes meet, and where they touch.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "simulate/exact/body.h"
#include "simulate/exact/collision_shape.h"
#include "simulate/exact/manifold.h"
#include "simulate/exact/surroundings.h"

namespace pilesim::exact {

// A point where two bodies touch or may touch within the step. World axes, single precision about
// the bodies' centres.
struct Contact {
  Vec3f arm_a, arm_b;                // m, from either centre
  Vec3f normal;                      // unit, from a to b
  float distance_m;                  // along the normal; below 0 they overlap
  float normal_force_n = 0;          // force along the normal in the last step, on b
  Vec3f friction_n = Vec3f::Zero();  // and across it
  Vec3f torque_nm = Vec3f::Zero();   // that holds back turning, on b
  float bounce = 0;    // m/s: the speed at which they are to part; below 0: at which they come yet
  float time_s = 0;    // from the step's begin until they are as the arms say
  float impact_s = 0;  // of a bounce: from what the arms say until the bodies touch; not kept
  float gap_m = 0;     // distance as the arms say; not kept
  bool hits = false;   // bodies meet hard in this step
  bool is_round = false;  // a side that rolls on: turning about its axis moves no surface
  // As it was found; see reuse_contacts().
  bool is_of_b = false;  // the normal is that of a face of b
  float found_distance_m = 0;
  Vec3f found_on_b = Vec3f::Zero();    // m, b's frame
  Vec3f found_normal = Vec3f::Zero();  // unit, from a to b, in the frame of a, or of b if is_of_b

  static void fields(auto& self, auto& stream) {
    stream(self.arm_a, self.arm_b, self.normal, self.distance_m, self.normal_force_n,
           self.friction_n, self.torque_nm, self.bounce, self.time_s, self.hits, self.is_round,
           self.is_of_b, self.found_distance_m, self.found_on_b, self.found_normal);
  }
  bool is_impact() const { return hits || bounce > 0; }
};

inline constexpr float kUntested = -1;  // the bound of what has not been tested yet

// Two pieces of them, or a triangle and a piece.
struct PiecePair {
  uint32_t a = 0, b = 0;
  // They were at least so far apart, less all motion since; below 0: look.
  float bound_m = kUntested;
  Vec3f axis = Vec3f::Zero();  // unit, from a to b in a's frame, or zero: not known
  int8_t side = 0;             // of a triangle: the one that the piece has come to; 0: not known

  static void fields(auto& self, auto& stream) {
    stream(self.a, self.b, self.bound_m, self.axis, self.known.a, self.known.b, self.known.count,
           self.side);
  }
  KnownVertices known = {};
};

struct Pair {
  uint32_t a, b;                 // bodies; a plane or a surface is a
  float bound_m = kUntested;     // as of pieces, of all of them
  Vec3f toward = Vec3f::Zero();  // unit, world: they are so far apart along it, or zero: in any way
  float list_bound_m = kUntested;  // as of all pieces that are not listed
  float motion_m = 0;              // since its pieces were looked at: they have not paid for it yet
  Vec3f exit_normal = Vec3f::Zero();  // unit, a's frame: along it penetrating b leaves, or zero
  std::vector<PiecePair> pieces;
  uint32_t first_contact = 0, contact_count = 0;  // in the state's list
  // Where b was in a's frame when the contacts were found, and how much nearer it may come before
  // there are others; below 0: contacts are not to be reused.
  Quatf found_turn = Quatf::Identity();
  Vec3 found_shift = Vec3::Zero();  // m
  float found_margin_m = -1;

  static void fields(auto& self, auto& stream) {
    stream(self.a, self.b, self.bound_m, self.toward, self.list_bound_m, self.motion_m,
           self.exit_normal, self.pieces, self.first_contact, self.contact_count, self.found_turn,
           self.found_shift, self.found_margin_m);
  }
  uint64_t key() const { return a < b ? uint64_t{a} << 32 | b : uint64_t{b} << 32 | a; }
};

// A body as the narrow phase sees it when a step begins.
struct PosedBody {
  PosedBody() = default;
  PosedBody(const Body& body, const CollisionShape& of_shape)
      : shape(&of_shape),
        position(body.position),
        turn(body.orientation.toRotationMatrix()),
        velocity(body.velocity),
        spin(body.spin),
        orientation(body.orientation),
        turning_m_s(turning_m_s_of(body, of_shape)),
        restitution(body.restitution),
        is_awake(body.is_awake()),
        is_moved_by_contacts(body.moves == Moves::by_contacts) {}

  static double turning_m_s_of(const Body& body, const CollisionShape& shape) {
    return body.spin.isZero(0) ? 0 : body.spin.norm() * shape.turning_radius_m;
  }

  const CollisionShape* shape = nullptr;
  Vec3 position;           // as of the body
  Mat3 turn;               // body to world
  Vec3 velocity, spin;     // as of the body
  Quat orientation;        // as turn
  double turning_m_s = 0;  // no point of it is faster by turning
  double restitution = 0;
  bool is_awake = false, is_moved_by_contacts = false;
};

struct NarrowScratch {
  struct Met {
    uint32_t a, b;  // pieces
    double gap_m;   // between their boxes; below 0: not known, or they meet
  };
  ManifoldScratch manifold;
  std::vector<SurfacePoint> points, all;
  std::vector<Contact> former;
  std::vector<PiecePair> pieces;
  std::vector<uint32_t> unsure;
  std::vector<Met> met;
  std::vector<uint8_t> taken;  // of the points
};

struct NarrowSettings {
  double step_s;
  double gravity;  // m/s^2, magnitude
  const ModelSurroundings* surroundings;
};

// A body's part in the bound on relative motion that tells whether two bodies may touch in the
// step; single precision.
struct MotionBound {
  Vec3f velocity = Vec3f::Zero();  // m/s
  float turning_m_s = 0;           // as PosedBody's
  Vec3f moved = Vec3f::Zero();     // m; as of the body
  float turned_m = 0;
  float extent_m = 0;  // that contacts are measured by; infinite: the other's
  bool is_awake = false, stands_still = false;
};

// Takes the motion since they were looked at off what the pair has been apart. False: nothing of
// them can touch within the step.
bool may_touch(Pair& pair, const MotionBound& a, const MotionBound& b,
               const NarrowSettings& settings);

// Appends to `contacts` the `former` ones where the bodies have come to, if they have hardly moved
// against each other since those were found: no contact is then missed or wrong by more than
// kResolution of the smaller extent. False: they are to be found again.
bool reuse_contacts(const Pair& pair, const PosedBody& a, const PosedBody& b,
                    const NarrowSettings& settings, std::span<const Contact> former,
                    std::vector<Contact>& contacts);

// Finds the contacts of the pair as its bodies stand, when may_touch() has not said that there are
// none, appends them to `contacts`, and gives them the forces of the `former` ones. Any thread, a
// pair each.
void find_contacts(Pair& pair, const PosedBody& a, const PosedBody& b,
                   const NarrowSettings& settings, std::span<const Contact> former,
                   std::vector<Contact>& contacts, NarrowScratch& scratch);

}  // namespace pilesim::exact
