// Rotation of bodies in contact in the exact engine.
#include <gtest/gtest.h>

#include <cmath>
#include <utility>
#include <vector>

#include "simulate/modes/make_simulator.h"
#include "support/small_model.h"
#include "support/small_simulation.h"

namespace pilesim {
namespace {

// A double cone of equal halves.
std::vector<Vec3> top_points(double radius, double half_height) {
  std::vector<Vec3> points = {{0, half_height, 0}, {0, -half_height, 0}};
  constexpr int kSides = 64;
  for (int i = 0; i < kSides; ++i) {
    const double angle = 2 * kPi * i / kSides;
    points.push_back({radius * std::cos(angle), 0, radius * std::sin(angle)});
  }
  return points;
}

// On ice its centre of mass stays in place. The ground's force turns its axis about the vertical at
// the rate W with (I3 w - I1 W cos t) W = m g h. Here t is its tilt, w its spin about its axis, and
// h the height of its centre over its tip along that axis.
TEST(ExactTurning, ATopOnIcePrecesses) {
  constexpr double kTilt = 0.35, kRate = 4, kHeight = 0.1;
  SmallModel m;
  m.scene.simulator.sleeping = false;
  const uint32_t ice = m.material(0, 0);
  m.body(m.plane(), ice, Vec3::Zero(), Role::fixed);
  const uint32_t shape = m.hull(top_points(0.1, kHeight));
  const MassProperties& mass = m.model.shapes[shape].mass;
  const Vec3 moments = mass.inertia_m5.diagonal() / mass.volume_m3;  // per kg
  const double spin =
      (9.81 * kHeight / kRate + moments.x() * kRate * std::cos(kTilt)) / moments.y();
  ModelBody& top = m.body(shape, ice, {0, kHeight * std::cos(kTilt), 0});
  top.pose.orientation = Quat(Eigen::AngleAxisd(-kTilt, Vec3::UnitZ()));
  const Vec3 axis = top.pose.orientation * Vec3::UnitY();  // leans towards x
  top.angular_velocity = kRate * Vec3::UnitY() + (spin - kRate * std::cos(kTilt)) * axis;
  const auto simulator = make_simulator(m.scene, m.model);
  const double frame_s = 1 / m.scene.frame_rate;
  for (int frame = 1; frame * frame_s < 0.5; ++frame) {
    run(*simulator, 1);
    const Vec3 now = simulator->states().orientation[1] * Vec3::UnitY();
    const double angle = kRate * frame * frame_s;
    EXPECT_NEAR(std::acos(now.y()), kTilt, 0.02) << frame;
    EXPECT_NEAR(std::remainder(std::atan2(-now.z(), now.x()) - angle, 2 * kPi), 0, 0.05) << frame;
  }
}

}  // namespace
}  // namespace pilesim
