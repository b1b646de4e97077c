// A single contact against closed forms.
#include "signature/trial/contact_impulse.h"

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/rotation.h"
#include "geometry/mass_properties.h"
#include "support/signature_bodies.h"

namespace pilesim {
namespace {

Flight standing_on(const ContactBody& body, const Quat& orientation, const Vec3& velocity,
                   const Vec3& spin) {
  Flight flight = test::make_flight(orientation, velocity, spin, 0);
  flight.height = lowest_vertex(body, flight.normal).height_m;
  return flight;
}

// A ball of radius r and inertia 2/5 r^2: only the point below the centre touches.
ContactBody ball(double radius) {
  return make_contact_body(sphere_mesh(radius, 4), Mat3::Identity() * 0.4 * radius * radius);
}

// The touching vertex of `ball`, rotated to lie exactly under the centre.
Flight on_a_vertex(const ContactBody& body, uint32_t vertex, const Vec3& velocity,
                   const Vec3& spin) {
  const Quat turn = rotation_between(body.vertices[vertex], -Vec3::UnitY());
  return standing_on(body, turn, velocity, spin);
}

TEST(Impulse, ASlidingBallLosesFrictionTimesTheNormalImpulse) {
  const double r = 0.5, e = 0.6, mu = 0.1;
  const ContactBody body = ball(r);
  Flight flight = on_a_vertex(body, 0, {3, -2, 0}, Vec3::Zero());
  apply_contact_impulse(body, {.restitution = e, .friction = mu}, 0, flight);
  const double j = (1 + e) * 2;
  EXPECT_NEAR((flight.velocity - Vec3(3 - mu * j, e * 2, 0)).norm(), 0, 1e-12);
  // Torque r x j: (0, -r, 0) x (-mu j, j, 0) = (0, 0, -r mu j).
  EXPECT_NEAR((flight.world_spin() - Vec3(0, 0, -r * mu * j / (0.4 * r * r))).norm(), 0, 1e-10);
}

TEST(Impulse, ABallThatGripsRollsOn) {
  const double r = 0.5, e = 0.6;
  const ContactBody body = ball(r);
  Flight flight = on_a_vertex(body, 0, {1, -2, 0.5}, {0, 3, 0});
  apply_contact_impulse(body, {.restitution = e, .friction = 1}, 0, flight);
  // 5/7 of the sliding speed remains, and the contact point is at rest.
  EXPECT_NEAR((flight.velocity - Vec3(5.0 / 7, e * 2, 2.5 / 7)).norm(), 0, 1e-12);
  const Vec3 point = flight.velocity + flight.world_spin().cross(Vec3(0, -r, 0));
  EXPECT_NEAR(Vec3(point.x(), 0, point.z()).norm(), 0, 1e-12);
  EXPECT_NEAR(flight.world_spin().y(), 3, 1e-12);
}

// A box that hits the plane with a corner below and beside its centre, without friction: j = (1 +
// e) v / (1 + (r x n) . I^-1 (r x n)).
TEST(Impulse, ABoxOnAnEdgeOrACornerTurnsAsItsInertiaSays) {
  const Vec3 size(0.2, 0.3, 0.5);
  const ContactBody body = test::box_body(size);
  const Mat3 inertia = box_mass_properties(size).inertia_m5 / box_mass_properties(size).volume_m3;
  for (const Quat& mesh_turn : {Quat(Eigen::AngleAxisd(0.4, Vec3::UnitZ())),
                                Quat(Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()))}) {
    const Quat turn = mesh_turn * body.principal_axes;
    Flight flight = standing_on(body, turn, {0, -1.5, 0}, Vec3::Zero());
    const uint32_t vertex = lowest_vertex(body, flight.normal).vertex;
    const Vec3 arm = turn * body.vertices[vertex];
    const Mat3 rotation = mesh_turn.toRotationMatrix();
    const Mat3 inverse = (rotation * inertia * rotation.transpose()).inverse();
    const Vec3 lever = arm.cross(Vec3::UnitY());
    const double j = 1.25 * 1.5 / (1 + lever.dot(inverse * lever));
    apply_contact_impulse(body, {.restitution = 0.25, .friction = 0}, vertex, flight);
    EXPECT_NEAR((flight.velocity - Vec3(0, -1.5 + j, 0)).norm(), 0, 1e-12);
    EXPECT_NEAR((flight.world_spin() - inverse * lever * j).norm(), 0, 1e-10);
  }
}

TEST(Impulse, DoesNothingToAPointThatLeaves) {
  const ContactBody body = ball(0.5);
  Flight flight = on_a_vertex(body, 0, {1, 0.5, 0}, {0, 0, 4});
  const Flight before = flight;
  EXPECT_LT(apply_contact_impulse(body, {}, 0, flight), 0);
  EXPECT_EQ(flight.velocity, before.velocity);
  EXPECT_EQ(flight.spin, before.spin);
}

TEST(Impulse, SlowContactsDoNotBounceBelowTheThreshold) {
  const ContactBody body = ball(0.5);
  const ContactMaterial material{.restitution = 0.5, .friction = 0, .restitution_threshold_m_s = 1};
  Flight slow = on_a_vertex(body, 0, {0, -0.9, 0}, Vec3::Zero());
  Flight fast = on_a_vertex(body, 0, {0, -1.1, 0}, Vec3::Zero());
  apply_contact_impulse(body, material, 0, slow);
  apply_contact_impulse(body, material, 0, fast);
  EXPECT_NEAR(slow.velocity.y(), 0, 1e-12);
  EXPECT_NEAR(fast.velocity.y(), 0.55, 1e-12);
}

TEST(Material, RefusesWhatIsNoMaterial) {
  for (const ContactMaterial& bad :
       {ContactMaterial{.restitution = 1.1}, ContactMaterial{.restitution = -0.1},
        ContactMaterial{.restitution = std::nan("")}, ContactMaterial{.friction = -1},
        ContactMaterial{.restitution_threshold_m_s = -1}}) {
    EXPECT_THROW(check_material(bad), Error);
  }
}

}  // namespace
}  // namespace pilesim
