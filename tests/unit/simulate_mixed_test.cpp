// The mixed mode: which bodies are solved and which are spheres, and that a change between them
// moves nothing.

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "core/error.h"
#include "support/mixed_scene.h"

namespace pilesim {
namespace {

using test::kExact;
using test::kSphere;
using Mixed = test::MixedScene;

TEST_F(Mixed, BodiesAreNearWhileTheirBoxesTouchAMustImpulseBody) {
  scene_.gravity.setZero();
  add("cube", {0, 0, 0}, kExact);
  // One passes closer than a step's way, the other at a clear distance.
  add("cube", {-1, kSide + 0.005, 0}, kSphere).linear_velocity = {2, 0, 0};
  add("cube", {-1, -kSide - 0.1, 0}, kSphere).linear_velocity = {2, 0, 0};
  start();
  for (int i = 0; i < 60; ++i) {
    run(1);
    EXPECT_FALSE(is_near(2));
    const double along = std::abs(states().position[1].x());
    if (along < kSide) {
      EXPECT_TRUE(is_near(1)) << along;
    } else if (along > kSide + 0.08) {  // the way of two steps, and a margin for leaving
      EXPECT_FALSE(is_near(1)) << along;
    }
  }
  EXPECT_LT((states().linear_velocity[1] - Vec3(2, 0, 0)).norm(), 1e-6);
}

TEST_F(Mixed, ABodyThatPassesTouchingBoxesGoesOnAsBefore) {
  scene_.gravity.setZero();
  // Rotated by 45 degrees about z: their boxes have room at the corners.
  Body& turned = add("cube", {0, 0, 0}, kExact);
  const Quat quarter(Eigen::AngleAxisd(kPi / 4, Vec3::UnitZ()));
  turned.pose.orientation = quarter;
  Body& added = add("cube", {-0.82, 1.18, 0}, kSphere);
  added.linear_velocity = {2, -2, 0};
  added.pose.orientation = quarter;
  const Body flying = added;
  start();
  const double energy = simulator_->statistics().kinetic_energy_j;
  bool was_near = false;
  for (int i = 0; i < 60; ++i) {
    const FrameStatistics statistics = run(1);
    was_near |= is_near(1);
    EXPECT_NEAR(statistics.kinetic_energy_j, energy, 1e-5 * energy);
    const Vec3 expected = flying.pose.position + (i + 1) / 60.0 * flying.linear_velocity;
    EXPECT_LT((states().position[1] - expected).norm(), 1e-5);
  }
  EXPECT_TRUE(was_near);
  EXPECT_FALSE(is_near(1));
}

TEST_F(Mixed, ChangesOfLevelMoveNothing) {
  // Bodies fly freely and tumble; the camera's distance takes them through three levels, the first
  // of which is always exact.
  scene_.gravity.setZero();
  scene_.simulator.detail.levels = {{.near_near = PairMethod::impulse,
                                     .near_far = PairMethod::particle,
                                     .far_far = PairMethod::particle,
                                     .exact = true},
                                    {.near_near = PairMethod::particle,
                                     .near_far = PairMethod::particle,
                                     .far_far = PairMethod::particle}};
  scene_.simulator.detail.distances_m = {5};
  scene_.camera.keys = {{.time_s = 0, .position = {0, 0, 3}, .target = {0, 0, 0}},
                        {.time_s = 0.5, .position = {0, 0, 9}, .target = {0, 0, 0}},
                        {.time_s = 1, .position = {0, 0, 3}, .target = {0, 0, 0}}};
  Body& body = add("cube", {0, 0, 0}, kSphere);  // a cube spins uniformly about any axis
  body.linear_velocity = {0.1, 0.2, 0};
  body.angular_velocity = {3, -2, 1};
  start();
  const double energy = simulator_->statistics().kinetic_energy_j;
  int changes = 0;
  bool before = true;
  for (int i = 0; i < 60; ++i) {
    const FrameStatistics statistics = run(1);
    changes += is_near(0) != before ? 1 : 0;
    before = is_near(0);
    EXPECT_NEAR(statistics.kinetic_energy_j, energy, 1e-5 * energy);
    const double time_s = (i + 1) / 60.0;
    EXPECT_LT((states().position[0] - time_s * body.linear_velocity).norm(), 1e-5);
    const Quat turned(Eigen::AngleAxisd(time_s * body.angular_velocity.norm(),
                                        body.angular_velocity.normalized()));
    EXPECT_LT(states().orientation[0].angularDistance(turned), 2e-4);
  }
  EXPECT_EQ(changes, 2);
}

TEST_F(Mixed, ExactPairsKeepMomentum) {
  scene_.gravity.setZero();
  Body& first = add("brick", {-0.4, 0.02, 0.01}, kExact);
  first.linear_velocity = {3, 0, 0};
  first.angular_velocity = {1, 2, 3};
  add("brick", {0.1, 0, 0}, kSphere);
  start();
  const auto momentum = [&]() -> Vec3 {
    return model_.bodies[0].mass_kg * (states().linear_velocity[0] + states().linear_velocity[1]);
  };
  const auto turning = [&] {
    Vec3 sum = Vec3::Zero();
    for (size_t i = 0; i < 2; ++i) {
      const ModelShape& shape = model_.shapes[model_.bodies[i].shape];
      const Mat3 turn = states().orientation[i].toRotationMatrix();
      sum += model_.bodies[i].mass_kg * (states().position[i].cross(states().linear_velocity[i]) +
                                         turn * (shape.mass.inertia_m5 / shape.mass.volume_m3) *
                                             turn.transpose() * states().angular_velocity[i]);
    }
    return sum;
  };
  const Vec3 before = momentum(), turning_before = turning();
  const double energy = simulator_->statistics().kinetic_energy_j;
  bool was_near = false;
  int frames = 0;
  for (int i = 0; i < 30; ++i) {
    const FrameStatistics statistics = run(1);
    was_near |= is_near(1);
    EXPECT_LE(statistics.kinetic_energy_j, energy * (1 + 1e-5));
    EXPECT_LT((momentum() - before).norm(), 1e-5 * before.norm());
    // Later it is a sphere, which turns about a constant axis, unlike a brick.
    if (was_near && !is_near(1)) continue;
    EXPECT_LT((turning() - turning_before).norm(), 0.01 * before.norm() * kSide) << i;
    ++frames;
  }
  EXPECT_TRUE(was_near);
  EXPECT_FALSE(is_near(1));
  EXPECT_GT(frames, 6);
  EXPECT_GT(states().linear_velocity[1].x(), 0.5);
}

// Both are solved against it.
TEST_F(Mixed, ABeltCarriesExactAndNearBodies) {
  constexpr double kSpeed = 1;
  add("slab", {0, -0.2, 0}, kExact, Role::fixed).surface_velocity =
      SurfaceVelocity{.linear = {kSpeed, 0, 0}};
  add("cube", {-1.5, kSide / 2, -1}, kExact);
  add("cube", {-1.5, kSide / 2, 1}, kSphere);
  start();
  run(90);
  EXPECT_TRUE(is_near(2));
  const double moved = kSpeed * (1.5 - kSpeed / (0.5 * 9.81) / 2);
  for (const uint32_t body : {1U, 2U}) {
    EXPECT_NEAR(states().linear_velocity[body].x(), kSpeed, 0.01 * kSpeed) << body;
    EXPECT_NEAR(states().position[body].x() + 1.5, moved, 0.02 * moved) << body;
  }
}

TEST_F(Mixed, NoSphereReachesAMustImpulseBody) {
  scene_.shapes["slab"] = BoxShape{{12, 0.4, 12}};  // nothing flies beyond it
  add("slab", {0, -0.2, 0}, kExact, Role::fixed);
  Body& hammer = add("brick", {0, 2, 0}, kExact);
  hammer.linear_velocity = {0, -8, 0};
  add_grid("cube", {4, 5, 4}, {0.3, 0.3, 0.3}, {0, 1, 0});
  start();
  const double half = kSide / 2;
  for (int i = 0; i < 90; ++i) {
    run(1);
    for (uint32_t body = 2; body < states().size(); ++body) {
      if (!is_far(body)) continue;
      // The box of a rotated cube is at least as large as the cube.
      EXPECT_GT(states().position[body].y(), half) << body << " in frame " << i;
    }
  }
  const auto figures = nlohmann::json::parse(simulator_->figures());
  EXPECT_GT(figures["entries"], 0);
}

TEST_F(Mixed, NearBodiesCarrySpheresAndAllComeToRest) {
  use_level(PairMethod::particle);
  add("slab", {0, -0.2, 0}, kExact, Role::fixed);
  for (const double x : {-0.13, 0.13}) {
    for (const double z : {-0.13, 0.13}) add("cube", {x, 0.12, z}, kSphere);
  }
  add("cube", {0.01, 0.4, 0}, kSphere);
  start();
  const FrameStatistics statistics = run(150);
  EXPECT_EQ(statistics.bodies_awake, 0U);
  for (uint32_t i = 1; i < 5; ++i) {
    EXPECT_TRUE(is_near(i));
    EXPECT_NEAR(states().position[i].y(), kSide / 2, 0.002);  // the box on the slab
    EXPECT_NEAR(std::abs(states().position[i].x()), 0.13, 0.02);
  }
  // A ball of the cube's volume between four.
  const double diameter = 2 * std::cbrt(3 / (4 * kPi)) * kSide;
  const double aside = std::sqrt(2) * 0.13;
  EXPECT_TRUE(is_far(5));
  EXPECT_NEAR(states().position[5].y(), kSide / 2 + std::sqrt(diameter * diameter - aside * aside),
              0.02);
}

TEST_F(Mixed, OverlapsAtEntryAreResolvedWithoutABurst) {
  // Overlapping cubes become exact when the camera approaches.
  scene_.gravity.setZero();
  scene_.simulator.detail.levels = {{.near_near = PairMethod::impulse,
                                     .near_far = PairMethod::particle,
                                     .far_far = PairMethod::particle,
                                     .exact = true}};
  add("cube", {0, 0, 0}, kSphere);
  add("cube", {0.12, 0.03, 0.01}, kSphere);
  start();
  const FrameStatistics statistics = run(60);
  EXPECT_LT(statistics.kinetic_energy_j, 1e-6);
  EXPECT_GT(states().position[1].x() - states().position[0].x(), 0.95 * kSide);
  const auto figures = nlohmann::json::parse(simulator_->figures());
  EXPECT_NEAR(figures["deepest_overlap_at_entry_m"], 0.08, 0.005);
  EXPECT_LT(figures["largest_energy_rise_at_entry_j"], 1e-6);
}

TEST_F(Mixed, RulesForPairsLetSpheresTouchAMustImpulseGround) {
  scene_.simulator.detail.pairs = {{"cube1", "slab0", PairMethod::particle}};
  add("slab", {0, -0.2, 0}, kExact, Role::fixed);
  add("cube", {0, 0.5, 0}, kSphere);
  add("cube", {1, 0.5, 0}, kSphere);
  start();
  run(120);
  EXPECT_TRUE(is_far(1));
  EXPECT_NEAR(states().position[1].y(), std::cbrt(3 / (4 * kPi)) * kSide, 0.002);
  EXPECT_TRUE(is_near(2));
  EXPECT_NEAR(states().position[2].y(), kSide / 2, 0.002);
}

TEST_F(Mixed, EventsReachBodiesWhateverTheyAre) {
  scene_.gravity.setZero();
  add("slab", {0, -0.2, 0}, kExact, Role::fixed);
  add("cube", {0, 0.1001, 0}, kSphere);  // near
  add("cube", {1, 1, 0}, kSphere);       // far
  add("cube", {-1, 1, 0}, kExact);
  add("cube", {0, 3, 0}, kSphere).held = true;
  for (const std::string name : {"cube1", "cube2", "cube3", "cube4"}) {
    scene_.events.push_back({.time_s = 0.1, .action = ImpulseEvent{{name}, {0, 8, 0}, {}}});
  }
  scene_.events.push_back({.time_s = 0.2, .action = RemoveEvent{{"cube2"}}});
  scene_.events.push_back({.time_s = 0.2, .action = ReleaseEvent{{"cube4"}}});
  start();
  run(10);
  for (const size_t body : {1, 2, 3}) {
    EXPECT_NEAR(states().linear_velocity[body].y(), 1, 1e-5) << body;  // 8 kg
  }
  EXPECT_NEAR(states().linear_velocity[4].y(), 0, 1e-5);
  run(10);
  EXPECT_EQ(states().flags[2] & kPresent, 0);
  EXPECT_EQ(states().flags[4] & kHeld, 0);
  EXPECT_TRUE(is_far(4));
}

TEST_F(Mixed, ChainsOfExactAndSphereContactsKeepMomentum) {
  // A must-impulse body pushes a near one, which pushes a row of spheres.
  scene_.gravity.setZero();
  scene_.materials["stuff"].restitution = 0;
  add("cube", {-0.6, 0, 0}, kExact).linear_velocity = {2, 0, 0};
  const double diameter = 2 * std::cbrt(3 / (4 * kPi)) * kSide;
  for (int i = 0; i < 3; ++i) add("cube", {i * diameter, 0, 0}, kSphere);
  start();
  const auto momentum = [&] {
    Vec3 sum = Vec3::Zero();
    for (const Vec3& velocity : states().linear_velocity) sum += velocity;
    return sum;
  };
  const double energy = simulator_->statistics().kinetic_energy_j;
  for (int i = 0; i < 40; ++i) {
    const FrameStatistics statistics = run(1);
    EXPECT_LT((momentum() - Vec3(2, 0, 0)).norm(), 1e-5) << i;
    EXPECT_LT(statistics.kinetic_energy_j, energy * (1 + 1e-5)) << i;
  }
  EXPECT_TRUE(is_near(1));
  EXPECT_TRUE(is_far(3));
  // Nothing bounces: all move on together.
  for (const Vec3& velocity : states().linear_velocity) EXPECT_NEAR(velocity.x(), 0.5, 0.02);
}

TEST_F(Mixed, ABodyWithContactsOfBothKindsComesToRest) {
  // A heap of spheres in an exact pit.
  add("slab", {0, -0.2, 0}, kExact, Role::fixed);
  for (const double side : {-1.0, 1.0}) {
    Body& across = add("slab", {2.28 * side, 1, 0}, kExact, Role::fixed);
    across.pose.orientation = Quat(Eigen::AngleAxisd(0.2 * side, Vec3::UnitZ()));
    add("slab", {0, 1, 2.24 * side}, kExact, Role::fixed);
  }
  add_grid("cube", {2, 6, 2}, {0.26, 0.3, 0.26}, {0, 1.4, 0}).linear_velocity_jitter = 0.5;
  start();
  const FrameStatistics statistics = run(360);
  EXPECT_EQ(statistics.bodies_awake, 0U);
  EXPECT_EQ(statistics.kinetic_energy_j, 0);
}

TEST_F(Mixed, NearBodiesStandOnTheGroundInTheirShape) {
  // Two crossed sticks, upright as an X, on a ground for spheres.
  scene_.shapes["stick"] = BoxShape{{1, 0.1, 0.1}};
  const Quat quarter(Eigen::AngleAxisd(kPi / 2, Vec3::UnitZ()));
  scene_.shapes["cross"] = CompoundShape{{{"stick", {}}, {"stick", {Vec3::Zero(), quarter}}}};
  add("ground", {0, 0, 0}, kSphere, Role::fixed);
  add("cube", {0.66, 0.5, 0}, kExact, Role::fixed);  // between two arms, inside the cross's box
  Body& cross = add("cross", {0.2, 0.5, 0}, kSphere);
  cross.pose.orientation = Quat(Eigen::AngleAxisd(kPi / 4, Vec3::UnitZ()));
  scene_.materials["stuff"].restitution = 0;
  start();
  run(90);
  EXPECT_TRUE(is_near(2));
  EXPECT_NEAR(states().position[2].y(), 0.55 * std::sqrt(0.5), 0.005);
}

TEST_F(Mixed, SpheresThatLieOnANearBodyDoNotPushItIntoWhatCarriesIt) {
  add("slab", {0, -0.2, 0}, kExact, Role::fixed);
  add("cube", {0, kSide / 2, 0}, kSphere);
  // Appears when the lower one is at rest, 0.1 m deep in it.
  Emitter& upper = add_grid("cube", {1, 1, 1}, {1, 1, 1}, {0, kSide / 2 + 0.15, 0});
  upper.start_s = 0.1;
  model_ = build_model(scene_);
  model_.crowded = true;  // it would wait
  simulator_ = make_simulator(scene_, model_);
  for (int i = 0; i < 20; ++i) {
    run(1);
    EXPECT_GT(states().position[1].y(), kSide / 2 - 0.002) << i;
  }
  EXPECT_GT(states().position[2].y(), 0.3);
}

TEST_F(Mixed, EachPieceOfAMustImpulseBodyHasItsOwnBox) {
  scene_.gravity.setZero();
  scene_.shapes["foot"] = BoxShape{{2, 0.1, 2}};
  scene_.shapes["shaft"] = BoxShape{{0.1, 2, 0.1}};
  scene_.shapes["pole"] = CompoundShape{
      {{"foot", {{0, 0.05, 0}, Quat::Identity()}}, {"shaft", {{0, 1.1, 0}, Quat::Identity()}}}};
  add("pole", {0, 0, 0}, kExact, Role::fixed);
  add("cube", {0.5, 1, 0.5}, kSphere);   // in the box of the whole
  add("cube", {0.14, 1, 0.1}, kSphere);  // at the shaft
  start();
  run(1);
  EXPECT_TRUE(is_far(1));
  EXPECT_TRUE(is_near(2));
}

TEST_F(Mixed, PenetratingSpheresSeparateNearMustImpulseBodiesToo) {
  add("slab", {0, -0.2, 0}, kExact, Role::fixed);
  add("cube", {0, kSide / 2, 0}, kSphere);
  add("cube", {kSide, kSide / 2, 0}, kSphere);
  start();
  run(60);
  EXPECT_TRUE(is_near(1) && is_near(2));
  const double diameter = 2 * std::cbrt(3 / (4 * kPi)) * kSide;
  EXPECT_NEAR((states().position[2] - states().position[1]).norm(), diameter, 0.02 * diameter);
}

TEST_F(Mixed, ASphereWakesASleeperThatIsNear) {
  add("slab", {0, -0.2, 0}, kExact, Role::fixed);
  add("cube", {0, 0.1, 0}, kSphere);
  Body& thrown = add("cube", {-0.8, 0.35, 0}, kSphere);
  thrown.linear_velocity = {4, 0.4, 0};
  thrown.held = true;
  scene_.events.push_back({.time_s = 2, .action = ReleaseEvent{{thrown.name}}});
  start();
  run(118);
  EXPECT_EQ(simulator_->statistics().bodies_awake, 0U);
  EXPECT_TRUE(is_near(1));
  run(30);
  EXPECT_GT(states().position[1].x(), 0.02);
}

TEST_F(Mixed, SleepersFeelAnImpactOnBodiesThatLeanOnThem) {
  // It arrives within a step, after spheres have found their contacts.
  add("ground", {0, 0, 0}, kSphere, Role::fixed);
  add("cube", {-0.5, kSide / 2, 0}, kExact).linear_velocity = {6, 0, 0};
  add("cube", {0, kSide / 2, 0}, kSphere);
  for (int i = 1; i < 4; ++i) add("cube", {i * kSide, kSide / 2, 0}, kSphere).asleep = true;
  start();
  run(2);
  EXPECT_EQ(simulator_->statistics().bodies_awake, 2U);
  run(5);
  EXPECT_EQ(simulator_->statistics().bodies_awake, 5U);
}

TEST_F(Mixed, SleepersBesideWhatStandsAreLeftAlone) {
  add("slab", {0, -0.2, 0}, kExact, Role::fixed);
  add("cube", {0, 0.1, 0}, kSphere).asleep = true;
  start();
  EXPECT_EQ(run(5).bodies_awake, 0U);
  EXPECT_TRUE(is_far(1));
}

TEST_F(Mixed, ReportsTellTheRiseOfEnergyAtAnEntry) {
  // Lifted out of the slab by the position correction.
  add("slab", {0, -0.2, 0}, kExact, Role::fixed);
  constexpr double kDepth = 0.05;
  add("cube", {0, kSide / 2 - kDepth, 0}, kSphere);
  start();
  run(1);
  const auto figures = nlohmann::json::parse(simulator_->figures());
  EXPECT_GT(figures["largest_energy_rise_at_entry_j"], 0);
  EXPECT_LT(figures["largest_energy_rise_at_entry_j"], 8 * 9.81 * kDepth);  // 8 kg
}

TEST_F(Mixed, HingesNeedMustImpulseBodies) {
  add("cube", {0, 1, 0}, kSphere).hinge = Hinge{};
  EXPECT_THROW(start(), Error);
}

TEST_F(Mixed, OnlyMustImpulseBodiesGiveTheImpulseMode) {
  scene_.step_s = Scene::kFixedStep;
  add("slab", {0, -0.2, 0}, kExact, Role::fixed);
  add("ground", {0, -0.3, 0}, kExact, Role::fixed);
  Emitter& grid = add_grid("brick", {3, 4, 3}, {0.4, 0.4, 0.4}, {0, 1, 0});
  grid.preference = kExact;
  Body& swing = add("brick", {1.5, 1, 0}, kExact);
  swing.hinge = Hinge{.axis = Vec3::UnitZ(), .anchor = {1.2, 1, 0}};
  start();
  run(60);
  const BodyStates mixed = states();
  scene_.simulator.mode = SimulatorMode::impulse;
  start();
  run(60);
  for (size_t i = 0; i < mixed.size(); ++i) {
    EXPECT_EQ(states().position[i], mixed.position[i]) << i;
    EXPECT_EQ(states().orientation[i].coeffs(), mixed.orientation[i].coeffs()) << i;
    EXPECT_EQ(states().linear_velocity[i], mixed.linear_velocity[i]) << i;
    EXPECT_EQ(states().flags[i], mixed.flags[i]) << i;
  }
}

TEST_F(Mixed, OnlyParticlesGiveTheParticleMode) {
  scene_.simulator.rest_control = false;
  add("ground", {0, 0, 0}, kSphere, Role::fixed);
  add_grid("brick", {4, 4, 4}, {0.3, 0.3, 0.3}, {0, 1, 0});
  start();
  run(60);
  const BodyStates mixed = states();
  scene_.simulator.mode = SimulatorMode::particle;
  start();
  run(60);
  for (size_t i = 0; i < mixed.size(); ++i) {
    EXPECT_EQ(states().position[i], mixed.position[i]) << i;
    EXPECT_EQ(states().orientation[i].coeffs(), mixed.orientation[i].coeffs()) << i;
    EXPECT_EQ(states().flags[i], mixed.flags[i]) << i;
  }
}

}  // namespace
}  // namespace pilesim
