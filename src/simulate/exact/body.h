// A body of the exact engine.
#pragma once

#include <cstdint>

#include "core/types.h"

namespace pilesim::exact {

enum class Moves : uint8_t {
  not_there,   // outside of the world
  never,       // fixed or held
  by_keys,     // kinematic
  by_contacts  // dynamic
};

// Plain data: all that a body is from one step to the next.
struct Body {
  // Members that tell whether it stands still come first.
  Vec3 position = Vec3::Zero();  // m, centre of mass, world
  uint32_t shape = 0;            // index into the model's shapes
  Moves moves = Moves::not_there;
  bool asleep = false;                   // by itself: a touch wakes it
  bool put_to_sleep = false;             // by a director: nothing but he does
  bool kept_apart = false;               // never meets others that are
  Quat orientation = Quat::Identity();   // body to world
  Vec3 moved = Vec3::Zero();             // m, in the last step, of its centre
  double turned_m = 0;                   // and no point of it has moved farther by turning
  Vec3 velocity = Vec3::Zero();          // m/s
  Vec3 spin = Vec3::Zero();              // rad/s, world
  double friction = 0, restitution = 0;  // its material's; of a pair the product's root
  double mass_kg = 0;                    // 0: moves not by contacts
  double load_rate2 = 0;  // 1/s^2: rate, squared, of the substeps that its loads need; StepSolver
  // Rest; see rest.h.
  double rest_time_s = 0;          // for so long it has been slow
  Vec3 rest_place = Vec3::Zero();  // m, world: where that time began

  static void fields(auto& self, auto& stream) {
    stream(self.position, self.orientation, self.velocity, self.spin, self.shape, self.moves,
           self.asleep, self.put_to_sleep, self.kept_apart, self.friction, self.restitution,
           self.mass_kg, self.load_rate2, self.moved, self.turned_m, self.rest_time_s,
           self.rest_place);
  }

  bool is_awake() const { return moves == Moves::by_contacts && !asleep && !put_to_sleep; }
  bool may_move() const { return is_awake() || moves == Moves::by_keys; }
  bool stands_still() const { return !may_move() && turned_m == 0 && moved.isZero(0); }
};

struct CollisionShape;

// Principal moments, kg m^2, and inverse inertia, 1 / kg m^2, world, of a body of that shape.
Vec3 principal_moments(const Body& body, const CollisionShape& shape);
Mat3 inverse_inertia(const Body& body, const CollisionShape& shape);

// m/s, of its point at `arm` (m, world) from its centre.
inline Vec3 velocity_at(const Body& body, const Vec3& arm) {
  return body.velocity + body.spin.cross(arm);
}

// On by a time in which nothing is near: a parabola, and a spin that nothing changes.
void fly(Body& body, const CollisionShape& shape, const Vec3& gravity, double time_s);

void wake_up(Body& body);  // if it is one that sleeps by itself
void fall_asleep(Body& body);

}  // namespace pilesim::exact
