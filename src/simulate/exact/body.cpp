#include "simulate/exact/body.h"

#include "simulate/exact/collision_shape.h"
#include "simulate/free_rotation.h"

namespace pilesim::exact {

Vec3 principal_moments(const Body& body, const CollisionShape& shape) {
  return body.mass_kg * shape.moments;
}

Mat3 inverse_inertia(const Body& body, const CollisionShape& shape) {
  const Mat3 turn = (body.orientation * shape.axes).toRotationMatrix();
  return turn * principal_moments(body, shape).cwiseInverse().asDiagonal() * turn.transpose();
}

void fly(Body& body, const CollisionShape& shape, const Vec3& gravity, double time_s) {
  const Vec3 displacement = time_s * body.velocity + (time_s * time_s / 2) * gravity;
  body.position += displacement;
  body.velocity += time_s * gravity;
  const double turn = time_s * body.spin.norm();
  const Vec3 moments = principal_moments(body, shape);
  if (turn > 0) rotate_freely(moments, shape.axes, time_s, body.orientation, body.spin);
  // The rate along the way is at most that of the same momentum about the least moment.
  const double most = turn > 0 ? moments.maxCoeff() / moments.minCoeff() : 1;
  body.moved += displacement;
  body.turned_m += turn * most * shape.turning_radius_m;
}

void wake_up(Body& body) {
  if (body.moves != Moves::by_contacts) return;
  body.asleep = false;
  body.rest_time_s = 0;
  body.rest_place = body.position;
}

void fall_asleep(Body& body) {
  body.velocity = body.spin = Vec3::Zero();
  body.asleep = true;
}

}  // namespace pilesim::exact
