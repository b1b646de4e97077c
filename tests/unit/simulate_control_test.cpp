// What a director may do to the impulse mode.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "simulate/impulse_control.h"
#include "support/small_model.h"
#include "support/small_simulation.h"

namespace pilesim {
namespace {

class Script final : public StepDirector {
 public:
  explicit Script(std::function<void(ImpulseControl&)> act) : act_(std::move(act)) {}
  void direct(ImpulseControl& control) override { act_(control); }

 private:
  std::function<void(ImpulseControl&)> act_;
};

// Frictionless ground 0, box 1 on it, box 2 slides against box 1 from the left.
struct Boxes : SmallModel {
  Boxes() {
    scene.frame_rate = 60;
    const uint32_t smooth = material(0, 0);
    body(plane(), smooth, Vec3::Zero(), Role::fixed);
    const uint32_t cube = box(Vec3::Constant(0.2));
    body(cube, smooth, {0, 0.1, 0});
    body(cube, smooth, {-0.5, 0.1, 0}).linear_velocity = {2, 0, 0};
  }
};

TEST(ImpulseControl, WhatWasPutToSleepStandsLikeAWall) {
  Boxes boxes;
  Script sleep([](ImpulseControl& control) { control.put_to_sleep(1); });
  const auto simulator = make_directed_simulator(boxes.scene, boxes.model, sleep);
  const FrameStatistics statistics = run(*simulator, 20);
  EXPECT_EQ(simulator->states().position[1], Vec3(0, 0.1, 0));
  EXPECT_NEAR(simulator->states().position[2].x(), -0.2, 2e-3);
  EXPECT_EQ(statistics.bodies_present, 3);
  EXPECT_EQ(statistics.bodies_awake, 1);
  EXPECT_TRUE(simulator->states().flags[1] & kAsleep);
  EXPECT_NEAR(statistics.potential_energy_j, 2 * 8 * 9.81 * 0.1, 0.5) << "sleepers have energy too";
}

TEST(ImpulseControl, ASleeperInTheAirStays) {
  Boxes boxes;
  boxes.model.bodies[1].pose.position.y() = 1;
  Script sleep([](ImpulseControl& control) { control.put_to_sleep(1); });
  const auto simulator = make_directed_simulator(boxes.scene, boxes.model, sleep);
  run(*simulator, 30);
  EXPECT_EQ(simulator->states().position[1], Vec3(0, 1, 0));
}

TEST(ImpulseControl, WokenBeforeTheHitTheyShareTheMomentum) {
  Boxes boxes;
  Script wake([](ImpulseControl& control) {
    if (control.time_s() == 0) control.put_to_sleep(1);
    if (control.motion(2).position.x() > -0.25) control.wake(1);
  });
  const auto simulator = make_directed_simulator(boxes.scene, boxes.model, wake);
  run(*simulator, 30);
  const std::vector<Vec3>& velocity = simulator->states().linear_velocity;
  EXPECT_GT(velocity[1].x(), 0.5);
  EXPECT_NEAR(velocity[1].x() + velocity[2].x(), 2, 1e-9);
}

TEST(ImpulseControl, FrictionIsThatOfTheDirector) {
  Boxes boxes;
  boxes.model.materials[0].friction = 0.5;
  Script script([](ImpulseControl& control) { control.set_friction(2, 0); });
  boxes.model.bodies[1].pose.position.x() = 9;
  const auto simulator = make_directed_simulator(boxes.scene, boxes.model, script);
  run(*simulator, 30);
  EXPECT_NEAR(simulator->states().linear_velocity[2].x(), 2, 1e-6);
}

TEST(ImpulseControl, ContactsPointFromTheSecondBodyToTheFirst) {
  Boxes boxes;
  std::vector<BodyContact> contacts;
  Script script([&](ImpulseControl& control) { control.read_contacts(contacts); });
  const auto simulator = make_directed_simulator(boxes.scene, boxes.model, script);
  run(*simulator, 2);
  double load_ns = 0;
  for (const BodyContact& contact : contacts) {
    ASSERT_TRUE(contact.a == 0 || contact.b == 0);
    const double up = contact.b == 0 ? 1 : -1;
    EXPECT_NEAR(contact.normal.y(), up, 1e-9);
    EXPECT_NEAR(contact.point.y(), 0, 1e-3);
    load_ns += contact.impulse_ns;
  }
  EXPECT_NEAR(load_ns, 2 * 8 * 9.81 * boxes.scene.actual_step_s(), 1e-3);
}

TEST(ImpulseControl, TiesHoldUntilTheyAreRemoved) {
  Boxes boxes;
  boxes.model.bodies[1].pose.position = {0, 1, 0};
  ConstraintId tie = 0;
  Script script([&](ImpulseControl& control) {
    if (control.time_s() == 0) tie = control.add_point_constraint(1, 0, {0, 1, 0});
    if (control.time_s() >= 0.5) control.remove_constraint(tie);
  });
  const auto simulator = make_directed_simulator(boxes.scene, boxes.model, script);
  run(*simulator, 30);
  EXPECT_NEAR(simulator->states().position[1].y(), 1, 1e-3);
  run(*simulator, 12);
  EXPECT_LT(simulator->states().position[1].y(), 0.9);
}

}  // namespace
}  // namespace pilesim
