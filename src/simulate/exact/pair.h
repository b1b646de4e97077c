// Two bodies whose boxes meet, and where they touch.
#pragma once

#include <cstdint>
#include <vector>

#include "simulate/exact/body.h"
#include "simulate/exact/collision_shape.h"
#include "simulate/exact/manifold.h"

namespace pilesim::exact {

// A point where two bodies touch or may touch within the step. World axes, single precision about
// the bodies' centres.
struct Contact {
  Vec3f arm_a, arm_b;                // m, from either centre
  Vec3f normal;                      // unit, from a to b
  float distance_m;                  // along the normal; below 0 they overlap
  float push_n = 0;                  // force along the normal in the last step, on b
  Vec3f friction_n = Vec3f::Zero();  // and across it
  float bounce = 0;                  // m/s, >= 0: the speed at which they are to part
  float time_s = 0;                  // from the step's begin until they are as the arms say
  bool hits = false;                 // bodies meet hard in this step
  bool is_round = false;  // a side that rolls on: turning about its axis moves no surface

  static void fields(auto& self, auto& stream) {
    stream(self.arm_a, self.arm_b, self.normal, self.distance_m, self.push_n, self.friction_n,
           self.bounce, self.time_s, self.hits, self.is_round);
  }
};

// Two pieces of them, or a triangle and a piece.
struct PiecePair {
  uint32_t a, b;
  float slack_m;         // they were at least so far apart, less all motion since; below 0: look
  Vec3f axis;            // unit, from a to b in a's frame, or zero: not known
  float looked_m = 0;    // motion since the direction was searched
  Feature feature = {};  // what they touched with then
  int8_t side = 0;       // of a triangle: the one that the piece has come to; 0: not known

  static void fields(auto& self, auto& stream) {
    stream(self.a, self.b, self.slack_m, self.axis, self.looked_m, self.feature.of,
           self.feature.face, self.known.a, self.known.b, self.known.count, self.side);
  }
  KnownVertices known = {};
};

struct Pair {
  uint32_t a, b;                  // bodies; a plane or a surface is a
  float slack_m = -1;             // as of pieces, of all of them
  float list_slack_m = -1;        // as of all pieces that are not listed
  float motion_m = 0;             // since its pieces were looked at: they have not paid for it yet
  Vec3f way_out = Vec3f::Zero();  // unit, a's frame: of what is sunk into it, or zero
  std::vector<PiecePair> pieces;
  std::vector<Contact> contacts;

  static void fields(auto& self, auto& stream) {
    stream(self.a, self.b, self.slack_m, self.list_slack_m, self.motion_m, self.way_out,
           self.pieces, self.contacts);
  }
  uint64_t key() const { return a < b ? uint64_t{a} << 32 | b : uint64_t{b} << 32 | a; }
};

// A body as a step begins.
struct Placed {
  Placed() = default;
  Placed(const Body& body, const CollisionShape& shape)
      : turn(body.orientation.toRotationMatrix()),
        turning_m_s(body.spin.isZero(0) ? 0 : body.spin.norm() * shape.radius_m) {}
  Mat3 turn;               // body to world
  double turning_m_s = 0;  // no point of it is faster by turning
};

struct NarrowScratch {
  ManifoldScratch manifold;
  std::vector<SurfacePoint> points, all;
  std::vector<Contact> former;
};

struct NarrowSettings {
  double step_s;
  double gravity;  // m/s^2, magnitude
};

// Finds the contacts of the pair as its bodies stand, and gives them the forces of those that were
// there before. Any thread, a pair each.
void find_contacts(Pair& pair, const Body& a, const Body& b, const Placed& placed_a,
                   const Placed& placed_b, const CollisionShape& shape_a,
                   const CollisionShape& shape_b, const NarrowSettings& settings,
                   NarrowScratch& scratch);

}  // namespace pilesim::exact
