// Control by a director: in the impulse mode, and in the mixed mode with solved bodies, spheres,
// and bodies that are both.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "core/philox.h"
#include "simulate/impulse_control.h"
#include "simulate/modes/make_simulator.h"
#include "support/small_model.h"
#include "support/small_simulation.h"

namespace pilesim {
namespace {

template <class Director, class Control>
class Script final : public Director {
 public:
  explicit Script(std::function<void(Control&)> act) : act_(std::move(act)) {}
  void direct(Control& control) override { act_(control); }

 private:
  std::function<void(Control&)> act_;
};
using BodyScript = Script<StepDirector, BodyControl>;
using ImpulseScript = Script<ImpulseDirector, ImpulseControl>;

enum class Engine { impulse, exact, near_exact, sphere };

void PrintTo(Engine engine, std::ostream* stream) {
  *stream << std::array{"impulse", "exact", "near_exact", "sphere"}[static_cast<size_t>(engine)];
}

// Frictionless ground 0, ball 1 on it, ball 2 slides against ball 1 from the left.
struct Balls : SmallModel {
  explicit Balls(Engine engine = Engine::impulse) {
    scene.frame_rate = 60;
    const uint32_t smooth = material(0, 0);
    body(plane(), smooth, Vec3::Zero(), Role::fixed);
    const uint32_t ball = sphere(0.1);
    model.shapes[ball].mesh = sphere_mesh(0.1);
    body(ball, smooth, {0, 0.1, 0});
    body(ball, smooth, {-0.5, 0.1, 0}).linear_velocity = {2, 0, 0};
    if (engine == Engine::impulse) return;
    scene.simulator.mode = SimulatorMode::mixed;
    scene.simulator.detail.levels = {{.near_near = PairMethod::impulse,
                                      .near_far = PairMethod::particle,
                                      .far_far = PairMethod::particle,
                                      .exact = engine == Engine::near_exact}};
    for (ModelBody& body : model.bodies) {
      body.preference =
          engine == Engine::exact ? Preference::must_impulse : Preference::prefer_statistical;
    }
  }
};

class ControlOf : public testing::TestWithParam<Engine> {
 protected:
  // Tolerance for a sphere of the same volume as the ball's mesh, in floats.
  static constexpr double kNear = 2e-3;

  std::unique_ptr<Simulator> directed(std::function<void(BodyControl&)> act) {
    script_.emplace(std::move(act));
    return make_directed_simulator(balls_.scene, balls_.model, *script_);
  }

  Balls balls_{GetParam()};

 private:
  std::optional<BodyScript> script_;
};

TEST_P(ControlOf, ABodyPutToSleepActsAsAWall) {
  const auto simulator = directed([](BodyControl& control) { control.put_to_sleep(1); });
  const FrameStatistics statistics = run(*simulator, 20);
  EXPECT_LT((simulator->states().position[1] - Vec3(0, 0.1, 0)).norm(), 1e-8);
  EXPECT_NEAR(simulator->states().position[2].x(), -0.2, kNear);
  EXPECT_LT(simulator->states().linear_velocity[2].norm(), 0.05);
  EXPECT_EQ(statistics.bodies_present, 3);
  EXPECT_TRUE(simulator->states().flags[1] & kAsleep);
  const double weight = balls_.model.bodies[1].mass_kg * 9.81;
  EXPECT_NEAR(statistics.potential_energy_j, 2 * weight * 0.1, 0.01 * weight)
      << "sleepers have energy too";
}

TEST_P(ControlOf, ABodyPutToSleepStops) {
  balls_.model.bodies[1].pose.position.x() = 9;
  const auto simulator = directed([](BodyControl& control) {
    if (control.time_s() > 0.1) control.put_to_sleep(2);
  });
  run(*simulator, 10);
  const Vec3 place = simulator->states().position[2];
  EXPECT_NEAR(place.x(), -0.5 + 2 * 0.11, 0.02);
  run(*simulator, 10);
  EXPECT_EQ(simulator->states().position[2], place);
  EXPECT_EQ(simulator->states().linear_velocity[2], Vec3(0, 0, 0));
}

TEST_P(ControlOf, ASleeperInTheAirStays) {
  balls_.model.bodies[1].pose.position.y() = 1;
  const auto simulator = directed([](BodyControl& control) { control.put_to_sleep(1); });
  run(*simulator, 30);
  EXPECT_LT((simulator->states().position[1] - Vec3(0, 1, 0)).norm(), 1e-7);
}

TEST_P(ControlOf, NothingElseThatHappensBesideASleeperWakesIt) {
  balls_.model.bodies[1].pose.position.y() = 1;
  balls_.model.bodies[2].pose.position = {0, 1.2, 0};
  balls_.model.bodies[2].linear_velocity = {0, -3, 0};
  balls_.model.events = {{.time_s = 0.2, .kind = ModelEvent::Kind::remove, .bodies = {2}}};
  const auto simulator = directed([](BodyControl& control) {
    if (control.time_s() == 0) control.put_to_sleep(1);
    EXPECT_EQ(control.is_in_world(2), control.time_s() < 0.199);
  });
  run(*simulator, 30);
  EXPECT_LT((simulator->states().position[1] - Vec3(0, 1, 0)).norm(), 1e-7);
}

// Also in a scene with structures, in which other bodies wake with their supports.
TEST_P(ControlOf, ASleeperStaysWhenWhatIsBelowItFalls) {
  balls_.model.bodies[1].pose.position.y() = 1;
  balls_.model.bodies[2].pose.position = {0, 0.8, 0};
  balls_.model.bodies[2].linear_velocity.setZero();
  balls_.body(1, 0, {9, 0.1, 0}).asleep = true;
  const auto simulator = directed([](BodyControl& control) {
    if (control.time_s() == 0) control.put_to_sleep(1);
  });
  run(*simulator, 30);
  EXPECT_LT((simulator->states().position[1] - Vec3(0, 1, 0)).norm(), 1e-7);
  EXPECT_LT(simulator->states().position[2].y(), 0.2);
}

TEST_P(ControlOf, AnImpulseMovesASleeper) {
  balls_.model.bodies[2].pose.position.x() = -9;
  const double mass_kg = balls_.model.bodies[1].mass_kg;
  balls_.model.events = {{.time_s = 0.2,
                          .kind = ModelEvent::Kind::impulse,
                          .bodies = {1},
                          .impulse = {3 * mass_kg, 0, 0}}};
  const auto simulator = directed([](BodyControl& control) {
    EXPECT_EQ(control.is_asleep(1), control.time_s() > 0 && control.time_s() < 0.199);
    if (control.time_s() == 0) control.put_to_sleep(1);
  });
  run(*simulator, 30);
  EXPECT_NEAR(simulator->states().position[1].x(), 0.9, 0.03);
  EXPECT_NEAR(simulator->states().linear_velocity[1].x(), 3, 1e-4);
}

TEST_P(ControlOf, WokenInTheAirItFalls) {
  balls_.model.bodies[1].pose.position.y() = 2;
  const auto simulator = directed([](BodyControl& control) {
    EXPECT_EQ(control.is_asleep(1), control.time_s() > 0 && control.time_s() < 0.501);
    if (control.time_s() == 0) control.put_to_sleep(1);
    if (control.time_s() > 0.499) control.wake(1);
  });
  run(*simulator, 50);
  const double fallen_s = 50 / 60.0 - 0.5;
  EXPECT_NEAR(simulator->states().linear_velocity[1].y(), -9.81 * fallen_s, 0.1);
}

TEST_P(ControlOf, WokenBeforeTheHitTheyShareTheMomentum) {
  const auto simulator = directed([](BodyControl& control) {
    if (control.time_s() == 0) control.put_to_sleep(1);
    if (control.motion(2).position.x() > -0.25) control.wake(1);
  });
  run(*simulator, 30);
  const std::vector<Vec3>& velocity = simulator->states().linear_velocity;
  EXPECT_GT(velocity[1].x(), 0.5);
  EXPECT_NEAR(velocity[1].x() + velocity[2].x(), 2, 4e-5);  // in single precision
}

TEST_P(ControlOf, VelocityIsThatOfTheDirector) {
  balls_.model.bodies[1].pose.position.x() = 9;
  const auto simulator = directed([](BodyControl& control) {
    if (control.time_s() == 0) control.set_velocity(2, {0, 0, 1}, {3, 0, 0});
  });
  run(*simulator, 30);
  EXPECT_NEAR(simulator->states().position[2].z(), 0.5, 1e-5);
  EXPECT_NEAR(simulator->states().position[2].x(), -0.5, 1e-5);
  EXPECT_NEAR(simulator->states().angular_velocity[2].x(), 3, 0.05);
}

TEST_P(ControlOf, FrictionIsThatOfTheDirector) {
  balls_.model.materials[0].friction = 0.5;
  balls_.model.bodies[1].pose.position.x() = 9;
  const auto slides = directed([](BodyControl& control) {
    if (control.time_s() == 0) control.set_friction(2, 0);
  });
  run(*slides, 30);
  EXPECT_NEAR(slides->states().linear_velocity[2].x(), 2, 1e-5);
  const auto rolls = directed([](BodyControl&) {});
  run(*rolls, 30);
  EXPECT_LT(rolls->states().linear_velocity[2].x(), 1.5);
}

// A spinning ball falls onto one that stands.
TEST_P(ControlOf, FrictionIsThatOfTheDirectorBetweenBodiesToo) {
  balls_.model.materials[0].friction = 0.5;
  balls_.model.bodies[2].pose.position = {0, 0.35, 0};
  balls_.model.bodies[2].linear_velocity.setZero();
  balls_.model.bodies[2].angular_velocity = {0, 0, 5};
  for (const double friction : {0.0, 0.5}) {
    const auto simulator = directed([&](BodyControl& control) {
      if (control.time_s() > 0) return;
      control.put_to_sleep(1);
      control.set_friction(1, friction);
    });
    run(*simulator, 10);
    const double sideways = std::abs(simulator->states().linear_velocity[2].x());
    if (friction == 0) {
      EXPECT_LT(sideways, 0.01);
    } else {
      EXPECT_GT(sideways, 0.04);
    }
  }
}

TEST_P(ControlOf, ContactsPointFromTheSecondBodyToTheFirst) {
  std::vector<BodyContact> contacts;
  const auto simulator = directed([&](BodyControl& control) { control.read_contacts(contacts); });
  run(*simulator, 2);
  ASSERT_EQ(contacts.size(), 2);
  for (const BodyContact& contact : contacts) {
    ASSERT_TRUE(contact.a == 0 || contact.b == 0);
    EXPECT_NEAR(contact.normal.y(), contact.b == 0 ? 1 : -1, 1e-9);
    EXPECT_NEAR(contact.point.y(), 0, kNear);
    EXPECT_NEAR(contact.distance_m, 0, kNear);
  }
}

TEST_P(ControlOf, ContactsAreThereWhileBodiesSleep) {
  balls_.model.bodies[2].pose.position = {0, 0.298, 0};
  balls_.model.bodies[2].linear_velocity.setZero();
  std::vector<BodyContact> contacts;
  const auto simulator = directed([&](BodyControl& control) {
    if (control.time_s() > 0.05) {
      control.put_to_sleep(1);
      control.put_to_sleep(2);
    }
    control.read_contacts(contacts);
  });
  run(*simulator, 60);
  ASSERT_EQ(contacts.size(), 2);
  const auto of_balls = std::ranges::find_if(
      contacts, [](const BodyContact& contact) { return contact.a != 0 && contact.b != 0; });
  ASSERT_NE(of_balls, contacts.end());
  EXPECT_NEAR(of_balls->normal.y(), of_balls->a == 2 ? 1 : -1, 1e-6);
  EXPECT_NEAR(of_balls->point.y(), 0.2, 2 * kNear);
}

INSTANTIATE_TEST_SUITE_P(AllEngines, ControlOf,
                         testing::Values(Engine::impulse, Engine::exact, Engine::near_exact,
                                         Engine::sphere),
                         testing::PrintToStringParamName());

// The camera approaches, leaves and approaches again while the ball slides.
TEST(MixedControl, AnImpulseMovesASleeperThatHasChangedEngines) {
  Balls balls(Engine::near_exact);
  balls.scene.simulator.detail.levels.push_back(balls.scene.simulator.detail.levels[0]);
  balls.scene.simulator.detail.levels[1].exact = false;
  balls.scene.simulator.detail.distances_m = {20};
  const auto camera = [](double time_s, double distance_m) {
    return CameraKey{.time_s = time_s, .position = {0, 0, distance_m}, .target = {0, 0, 0}};
  };
  balls.scene.camera.keys = {camera(0.3, 40),  camera(0.31, 9), camera(0.7, 9),
                             camera(0.71, 40), camera(1, 40),   camera(1.01, 9)};
  balls.model.bodies[2].pose.position.x() = -9;
  balls.model.bodies[2].linear_velocity.setZero();
  balls.model.events = {{.time_s = 0.5,
                         .kind = ModelEvent::Kind::impulse,
                         .bodies = {1},
                         .impulse = {3 * balls.model.bodies[1].mass_kg, 0, 0}}};
  BodyScript script([](BodyControl& control) {
    if (control.time_s() == 0) control.put_to_sleep(1);
  });
  const auto simulator = make_directed_simulator(balls.scene, balls.model, script);
  const auto is_solved = [&] { return (simulator->states().flags[1] & kImpulse) != 0; };
  std::vector<bool> solved;
  for (const int frames : {15, 24, 18, 18}) {
    run(*simulator, frames);
    solved.push_back(is_solved());
  }
  EXPECT_EQ(solved, (std::vector<bool>{false, true, false, true}));
  EXPECT_NEAR(simulator->states().position[1].x(), 3 * 0.75, 0.03);
  EXPECT_NEAR(simulator->states().linear_velocity[1].x(), 3, 1e-3);
}

// All pairs, one by one. A large ball is among the small ones; some sleep.
TEST(SphereContacts, AreThoseOfAllPairs) {
  constexpr uint32_t kBalls = 300;
  Balls balls(Engine::sphere);
  balls.scene.gravity.setZero();
  balls.model.bodies.clear();
  const uint32_t large = balls.sphere(0.7);
  balls.model.shapes[large].mesh = sphere_mesh(0.7);
  Philox random(7, Stream::test, 0);
  for (uint32_t i = 0; i < kBalls; ++i) {
    const auto place = [&] { return 4 * random.uniform() - 2; };
    balls.body(i % 20 == 10 ? large : 1, 0, {place(), place(), place()});
  }
  std::vector<std::pair<uint32_t, uint32_t>> found, expected;
  BodyScript script([&](BodyControl& control) {
    if (control.time_s() > 0) return;
    for (uint32_t i = 0; i < kBalls; i += 3) control.put_to_sleep(i);
    std::vector<BodyContact> contacts;
    control.read_contacts(contacts);
    for (const BodyContact& contact : contacts) {
      found.emplace_back(contact.a, contact.b);
      const Vec3 way = control.motion(contact.a).position - control.motion(contact.b).position;
      EXPECT_NEAR(contact.normal.dot(way.normalized()), 1, 1e-6);
      EXPECT_NEAR((contact.point - control.motion(contact.b).position).norm(),
                  contact.b % 20 == 10 ? 0.7 : 0.1, 0.01);
    }
  });
  const auto simulator = make_directed_simulator(balls.scene, balls.model, script);
  for (uint32_t i = 0; i < kBalls; ++i) {
    for (uint32_t j = i + 1; j < kBalls; ++j) {
      const double radii = (i % 20 == 10 ? 0.7 : 0.1) + (j % 20 == 10 ? 0.7 : 0.1);
      const double way =
          (balls.model.bodies[i].pose.position - balls.model.bodies[j].pose.position).norm();
      if (way < radii) expected.emplace_back(i, j);
    }
  }
  run(*simulator, 1);
  std::ranges::sort(found);
  for (const auto& pair : expected) {
    EXPECT_TRUE(std::ranges::binary_search(found, pair)) << pair.first << ' ' << pair.second;
  }
  EXPECT_LE(found.size(), expected.size() + expected.size() / 10) << "within the margin";
  EXPECT_EQ(std::ranges::adjacent_find(found), found.end());
}

TEST(ImpulseControl, NailsHoldUntilTheyAreRemoved) {
  Balls balls;
  balls.model.bodies[1].pose.position = {0, 1, 0};
  ConstraintId nail = 0;
  ImpulseScript script([&](ImpulseControl& control) {
    if (control.time_s() == 0) {
      nail = control.add_nail(
          {.a = 1, .b = 0, .point = {0, 1, 0}, .axis = Vec3::UnitY(), .breaking_impulse_ns = 1e9});
    }
    if (control.time_s() >= 0.5) control.remove_constraint(nail);
  });
  const auto simulator = make_directed_simulator(balls.scene, balls.model, script);
  run(*simulator, 30);
  EXPECT_NEAR(simulator->states().position[1].y(), 1, 1e-3);
  run(*simulator, 12);
  EXPECT_LT(simulator->states().position[1].y(), 0.9);
}

// The support of an arm turns with the nail's axis: none of it drives the arm about that axis.
TEST(ImpulseControl, ATurningNailDrivesNothing) {
  SmallModel turntable;
  turntable.scene.frame_rate = 60;
  const uint32_t smooth = turntable.material(0, 0);
  turntable.body(turntable.plane(), smooth, Vec3::Zero(), Role::fixed);
  const Vec3 spin(0, 3, 0), arm(0.36, 0.2, 0);
  turntable.body(turntable.box({0.4, 0.4, 0.4}), smooth, {0, 0.2, 0}).angular_velocity = spin;
  ModelBody& held = turntable.body(turntable.box({0.3, 0.05, 0.05}), smooth, arm);
  held.angular_velocity = spin;
  held.linear_velocity = spin.cross(arm);
  ImpulseScript script([&](ImpulseControl& control) {
    if (control.time_s() > 0) return;
    control.add_nail({.a = 2,
                      .b = 1,
                      .point = {0.2, 0.2, 0},
                      .axis = Vec3::UnitX(),
                      .breaking_impulse_ns = 1e9});
  });
  const auto simulator = make_directed_simulator(turntable.scene, turntable.model, script);
  run(*simulator, 120);
  const BodyStates& states = simulator->states();
  const Vec3 axis = (states.position[2] - states.position[1]).normalized();
  EXPECT_NEAR(axis.y(), 0, 0.01);
  EXPECT_NEAR(states.angular_velocity[2].y(), 3, 0.1);
  EXPECT_NEAR(states.angular_velocity[2].dot(axis), 0, 0.1);
}

// By the impulse of the whole step, which an impact transmits at its start.
TEST(ImpulseControl, AnImpactBreaksAWeakerNail) {
  for (const double share : {0.5, 2.0}) {
    Balls balls;
    balls.model.bodies[1].pose.position = {0, 1, 0};
    const double strength_ns = 5 * balls.model.bodies[1].mass_kg;
    balls.model.events.push_back({.time_s = 0.1,
                                  .kind = ModelEvent::Kind::impulse,
                                  .bodies = {1},
                                  .impulse = share * strength_ns * Vec3::UnitX()});
    ConstraintId nail = 0;
    bool holds = true;
    ImpulseScript script([&](ImpulseControl& control) {
      if (control.time_s() == 0) {
        nail = control.add_nail({.a = 1,
                                 .b = 0,
                                 .point = {0, 1, 0},
                                 .axis = Vec3::UnitY(),
                                 .breaking_impulse_ns = strength_ns});
      }
      holds = control.holds(nail);
    });
    const auto simulator = make_directed_simulator(balls.scene, balls.model, script);
    run(*simulator, 20);
    EXPECT_EQ(holds, share < 1) << share;
  }
}

}  // namespace
}  // namespace pilesim
