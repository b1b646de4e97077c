// Effects of a guide on piles.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "geometry/primitives.h"
#include "pile/guide/guide_fit.h"
#include "pile/guide/guided_simulator.h"
#include "pile/guide/surface_profile.h"
#include "support/small_model.h"
#include "support/small_simulation.h"

namespace pilesim {
namespace {

// A column of cubes of 0.2 m, or `scale` times that, on the ground: bodies 1 .. count, from below.
// Time scales with the root of the scale, so that all columns move alike.
struct BoxColumn : SmallModel {
  explicit BoxColumn(int count, double scale = 1) {
    scene.frame_rate = 60 / std::sqrt(scale);
    scene.step_s = std::sqrt(scale) / 240;
    scene.guide.emplace().hold = HoldKind::freeze;
    wood = material(0, 0.7);
    body(plane(), wood, Vec3::Zero(), Role::fixed);
    const uint32_t cube = box(Vec3::Constant(0.2 * scale));
    for (int i = 0; i < count; ++i) body(cube, wood, {0, scale * (0.1 + 0.2 * i), 0});
  }
  uint32_t wood = 0;
};

TEST(Guide, StandingBodiesAreFixedAndDoNotDrift) {
  BoxColumn column(5);
  GuidedSimulator simulator(column.scene, column.model);
  run(simulator, 10);
  EXPECT_EQ(simulator.frames().back().counts.held, 5);
  EXPECT_EQ(simulator.states().flags[3] & (kFrozen | kPassed | kFailed), kFrozen | kPassed);
  const Vec3 top = simulator.states().position[5];
  run(simulator, 300);
  EXPECT_EQ(simulator.states().position[5], top);
}

TEST(Guide, WithoutControlItOnlyTells) {
  BoxColumn column(3);
  column.scene.guide->control = false;
  GuidedSimulator simulator(column.scene, column.model);
  run(simulator, 10);
  EXPECT_EQ(simulator.frames().back().counts.held, 0);
  EXPECT_EQ(simulator.frames().back().counts.passed, 3);
}

TEST(Guide, BodiesOutsideItAreLeftAlone) {
  BoxColumn column(4);
  column.model.guide = box_mesh({2, 0.7, 2});  // up to 0.35 m: the lower two
  GuidedSimulator simulator(column.scene, column.model);
  run(simulator, 10);
  EXPECT_EQ(simulator.frames().back().counts.in_guide, 2);
  EXPECT_EQ(simulator.frames().back().counts.held, 2);
}

// A leaning column: its upper half overhangs, but each cube alone would stand.
TEST(Guide, HoldsAsAWholeWhatStandsBodyByBody) {
  for (const bool control : {true, false}) {
    BoxColumn column(6);
    column.scene.guide->control = control;
    for (int i = 1; i <= 6; ++i) column.model.bodies[i].pose.position.x() = 0.06 * i;
    GuidedSimulator simulator(column.scene, column.model);
    run(simulator, 120);
    EXPECT_EQ(simulator.states().position[6].y() > 1.09, control);
  }
}

TEST(Guide, AHitKnocksLooseWhatItCouldMoveAtAnyScale) {
  for (const double scale : {0.05, 1.0, 20.0}) {
    for (const double speed : {0.05, 6.0}) {
      BoxColumn column(5, scale);
      const uint32_t ball = column.sphere(0.15 * scale);
      ModelBody& thrown = column.body(ball, column.wood, scale * Vec3(-0.27, 0.5, 0));
      thrown.linear_velocity = Vec3(speed * std::sqrt(scale), 0, 0);
      thrown.start_s = 0.2 * std::sqrt(scale);
      GuidedSimulator simulator(column.scene, column.model);
      run(simulator, 60);
      EXPECT_EQ(simulator.frames().back().counts.knocked_loose > 0, speed > 1) << speed;
      EXPECT_EQ(simulator.states().position[3].x() > 0.05 * scale, speed > 1) << speed;
    }
  }
}

// Each starts a tenth inside the next. They separate slowly before they are fixed.
TEST(Guide, OverlapsOfTheStartAreUndoneWithoutABurst) {
  BoxColumn column(6);
  for (int i = 1; i <= 6; ++i) column.model.bodies[i].pose.position.y() = 0.1 + 0.18 * (i - 1);
  GuidedSimulator simulator(column.scene, column.model);
  double fastest = 0;
  for (int frame = 0; frame < 60; ++frame) {
    simulator.step_frame();
    for (int i = 1; i <= 6; ++i) {
      fastest = std::max(fastest, simulator.states().linear_velocity[i].norm());
    }
  }
  EXPECT_EQ(simulator.frames().back().counts.held, 6);
  const auto& place = simulator.states().position;
  for (int i = 2; i <= 6; ++i) {
    EXPECT_GT(place[i].y() - place[i - 1].y(), 0.2 - 1.1 * 0.03 * 0.173);
    EXPECT_LT(place[i].y() - place[i - 1].y(), 0.2 + 1e-3);
    EXPECT_NEAR(place[i].x(), 0, 0.01);
  }
  EXPECT_LT(fastest, 0.3) << "a fall through 5 mm";
}

// Otherwise a high pile would lean before its overlaps are gone.
TEST(Guide, WhileBodiesOverlapEveryStepIsControlled) {
  const auto control_steps = [](double spacing, int frames) {
    BoxColumn column(12);
    for (int i = 1; i <= 12; ++i) {
      column.model.bodies[i].pose.position.y() = 0.1 + spacing * (i - 1);
    }
    GuidedSimulator simulator(column.scene, column.model);
    run(simulator, frames);
    return simulator.control_steps();
  };
  // 40 steps: two periods.
  EXPECT_LE(control_steps(0.2, 10), 21);
  EXPECT_GT(control_steps(0.18, 10), 25);
  // 100 steps: five of them for overlaps, which are gone in the first.
  EXPECT_LE(control_steps(0.194, 25), 27);
}

// Whatever its mass: further objects may be placed on a guide's pile.
TEST(Guide, ASlowContactIsNoImpact) {
  BoxColumn column(5);
  column.scene.guide->most_speed = 0.02;   // so that the ball itself is not fixed
  column.scene.guide->neighbours = false;  // nor frees the column by mere contact
  const uint32_t ball = column.sphere(0.15);
  ModelBody& slow = column.body(ball, column.wood, {-0.27, 0.15, 0});
  slow.linear_velocity = {0.08, 0, 0};
  slow.angular_velocity = {0, 0, -0.08 / 0.15};
  slow.mass_kg = 2000;
  GuidedSimulator simulator(column.scene, column.model);
  run(simulator, 60);
  EXPECT_EQ(simulator.frames().back().counts.knocked_loose, 0);
  EXPECT_LT(std::abs(simulator.states().position[5].x()), 1e-3);
  EXPECT_GT(simulator.states().position[6].x(), -0.26) << "it came";
}

TEST(Guide, ASixthOfAFallIsAnImpact) {
  BoxColumn column(5);
  column.scene.guide->most_speed = 0.02;
  column.scene.guide->neighbours = false;  // as above
  const uint32_t ball = column.sphere(0.15);
  ModelBody& heavy = column.body(ball, column.wood, {-0.27, 0.15, 0});
  heavy.linear_velocity = {0.2, 0, 0};  // sqrt(g r) is 1.3 m/s
  heavy.angular_velocity = {0, 0, -0.2 / 0.15};
  heavy.mass_kg = 2000;
  GuidedSimulator simulator(column.scene, column.model);
  run(simulator, 60);
  EXPECT_GT(simulator.frames().back().counts.knocked_loose, 0);
}

TEST(Guide, BodiesThatPenetrateByThreePerCentOfARadiusSeparateFirst) {
  const auto held = [](double share) {
    BoxColumn column(2);
    column.model.bodies[2].pose.position.y() -= share * 0.1 * std::sqrt(3);
    GuidedSimulator simulator(column.scene, column.model);
    run(simulator, 1);
    return simulator.frames().back().counts.held;
  };
  EXPECT_EQ(held(0.025), 2);
  EXPECT_EQ(held(0.055), 0);
}

TEST(Guide, MovingBodiesAreNotFixed) {
  BoxColumn column(1);
  column.model.bodies[1].linear_velocity = {2, 0, 0};
  GuidedSimulator simulator(column.scene, column.model);
  run(simulator, 60);
  EXPECT_NEAR(simulator.states().position[1].x(), 2 * 2 / (2 * 0.7 * 9.81), 0.06);
  EXPECT_EQ(simulator.frames().back().counts.held, 1);
}

TEST(Guide, ABodyWithoutSupportIsReleased) {
  BoxColumn column(3);
  column.model.events.push_back({0.5, ModelEvent::Kind::remove, {1}, Vec3::Zero(), {}});
  GuidedSimulator simulator(column.scene, column.model);
  run(simulator, 30);
  uint32_t fewest = 3;
  for (int frame = 0; frame < 60; ++frame) {
    simulator.step_frame();
    fewest = std::min(fewest, simulator.frames().back().counts.held);
  }
  EXPECT_EQ(fewest, 0) << "in the air";
  EXPECT_NEAR(simulator.states().position[2].y(), 0.1, 0.01);
  EXPECT_NEAR(simulator.states().position[3].y(), 0.3, 0.01);
}

TEST(Guide, ABodyThatWaitsForItsReleaseCarries) {
  BoxColumn column(3);
  column.model.bodies[1].held = true;
  column.model.bodies[1].pose.position.y() += 1;
  column.model.bodies[2].pose.position.y() += 1;
  column.model.bodies[3].pose.position.y() += 1;
  GuidedSimulator simulator(column.scene, column.model);
  run(simulator, 30);
  EXPECT_EQ(simulator.frames().back().counts.held, 2);
  EXPECT_NEAR(simulator.states().position[3].y(), 1.5, 1e-3);
  EXPECT_LT(simulator.frames().back().largest_drift_m, 1e-3);
  EXPECT_NEAR(simulator.frames().back().height_m, 0.2, 1e-3) << "without what waits";
}

TEST(Guide, BodiesThatFallIntoItAreControlledFromThenOn) {
  BoxColumn column(1);
  column.model.guide = box_mesh({2, 1, 2});
  column.model.bodies[1].pose.position.y() = 1.2;
  GuidedSimulator simulator(column.scene, column.model);
  run(simulator, 6);
  EXPECT_EQ(simulator.frames().back().counts.in_guide, 0);
  run(simulator, 60);
  EXPECT_EQ(simulator.frames().back().counts.in_guide, 1);
  EXPECT_EQ(simulator.frames().back().counts.held, 1);
}

TEST(Guide, SaysWhereBodiesAreHeld) {
  BoxColumn column(4);
  GuidedSimulator simulator(column.scene, column.model);
  run(simulator, 30);
  ASSERT_FALSE(simulator.constraints().empty());
  const GuideConstraints& last = simulator.constraints().back();
  EXPECT_LE(last.frame, 30);
  ASSERT_EQ(last.points.size(), 4);
  std::vector<double> heights;
  for (const Vec3& point : last.points) {
    heights.push_back(point.y());
    EXPECT_LT(std::max(std::abs(point.x()), std::abs(point.z())), 0.12);
  }
  std::ranges::sort(heights);
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(heights[i], 0.2 * i, 0.01);
}

TEST(Guide, TheSameSceneGivesTheSameBits) {
  std::vector<Vec3> first;
  for (int round = 0; round < 2; ++round) {
    BoxColumn column(6);
    const uint32_t ball = column.sphere(0.15);
    column.body(ball, column.wood, {-1, 0.5, 0.03}).linear_velocity = {5, 0, 0};
    GuidedSimulator simulator(column.scene, column.model);
    run(simulator, 60);
    if (round == 0) first = simulator.states().position;
    EXPECT_EQ(simulator.states().position, first);
  }
}

TEST(Guide, NeedsTheImpulseMode) {
  BoxColumn column(1);
  column.scene.simulator.mode = SimulatorMode::statistical;
  EXPECT_THROW(GuidedSimulator(column.scene, column.model), Error);
  column.scene.simulator.mode = SimulatorMode::impulse;
  column.scene.guide.reset();
  EXPECT_THROW(GuidedSimulator(column.scene, column.model), Error);
}

// Also bodies many voxels wide among mostly small ones.
TEST(Guide, FitSeesAllOfALargeBody) {
  SmallModel large;
  const uint32_t stone = large.material(0, 0.7);
  large.body(large.box(Vec3::Constant(1)), stone, Vec3::Zero());
  const uint32_t crumb = large.box(Vec3::Constant(0.05));
  for (int i = 0; i < 40; ++i) large.body(crumb, stone, {-0.4 + 0.02 * i, 0.2, 0.1});
  large.model.guide = box_mesh(Vec3::Constant(1));
  const BodyStates states = large.states();
  const GuideFit fit = measure_guide_fit(large.scene, large.model, states);
  ASSERT_LT(fit.voxel_m, 0.1);
  EXPECT_GT(fit.overlap, 0.7);
}

TEST(Guide, FitIsTheShareInsideAndTheOverlap) {
  BoxColumn column(4);
  const BodyStates states = column.states();
  column.model.guide = box_mesh({0.2, 0.8, 0.2});  // its lower half is below the ground
  const GuideFit fit = measure_guide_fit(column.scene, column.model, states);
  EXPECT_DOUBLE_EQ(fit.bodies_inside, 0.5);
  EXPECT_DOUBLE_EQ(fit.volume_inside, 0.5);
  EXPECT_GT(fit.overlap, 0.2);
  EXPECT_LT(fit.overlap, 0.5);
  for (Vec3& vertex : column.model.guide.vertices) vertex.y() += 0.4;
  EXPECT_GT(measure_guide_fit(column.scene, column.model, states).overlap, 0.6)
      << "the column itself";
  for (Vec3& vertex : column.model.guide.vertices) vertex.x() += 5;
  EXPECT_EQ(measure_guide_fit(column.scene, column.model, states).overlap, 0);
  EXPECT_EQ(measure_guide_fit(column.scene, column.model, states).bodies_inside, 0);
}

// Cubes of a quarter of a metre centred at `places`, in a guide of one cubic metre.
SurfaceProfile surface_of_cubes(const std::vector<Vec3>& places) {
  SmallModel cubes;
  const uint32_t wood = cubes.material(0, 0.7), cube = cubes.box(Vec3::Constant(0.25));
  for (const Vec3& place : places) cubes.body(cube, wood, place);
  cubes.model.guide = box_mesh(Vec3::Constant(1));
  for (Vec3& vertex : cubes.model.guide.vertices) vertex.y() += 0.5;
  return measure_surface(cubes.model, cubes.states(), 0.1);
}

TEST(Guide, SurfaceOfAPileThatFillsABoxIsTheBoxs) {
  std::vector<Vec3> places;
  for (int i = 0; i < 64; ++i) places.push_back(0.25 * Vec3(i % 4, i / 16, i / 4 % 4));
  for (Vec3& place : places) place += Vec3(-0.375, 0.125, -0.375);
  const SurfaceProfile full = surface_of_cubes(places);
  EXPECT_NEAR(full.difference, 0, 1e-9);
  EXPECT_NEAR(full.slope_deg, 0, 1e-9);
  EXPECT_NEAR(full.guide_slope_deg, 0, 1e-9);
  for (const SurfaceRing& ring : full.rings) {
    EXPECT_NEAR(ring.height_m, 1, 1e-9);
    EXPECT_NEAR(ring.guide_height_m, 1, 1e-9);
  }
  // Without its top layer it is a quarter too low.
  const SurfaceProfile low = surface_of_cubes({places.begin(), places.begin() + 48});
  EXPECT_NEAR(low.difference, 0.25, 1e-9);
  EXPECT_NEAR(low.slope_deg, 0, 1e-9);
  // Beside it, eight per layer, they are equally too high; far away they only count as missing.
  for (int i = 0; i < 16; ++i) {
    places[48 + i] = Vec3(0.625, 0.125, -0.375) + 0.25 * Vec3(i / 4 % 2, i / 8, i % 4);
  }
  EXPECT_NEAR(surface_of_cubes(places).difference, 0.5, 1e-9);
  for (int i = 48; i < 64; ++i) places[i].x() += 5;
  EXPECT_NEAR(surface_of_cubes(places).difference, 0.25, 1e-9);
  EXPECT_EQ(surface_of_cubes({}).column_m, 0);
}

// About the y axis, on the ground.
TriangleMesh cone(double radius, double height) {
  constexpr int kSides = 96;
  TriangleMesh mesh;
  mesh.vertices = {{0, height, 0}, {0, 0, 0}};
  for (uint32_t i = 0; i < kSides; ++i) {
    const double angle = 2 * kPi * i / kSides;
    mesh.vertices.push_back(radius * Vec3(std::cos(angle), 0, std::sin(angle)));
    const uint32_t here = 2 + i, next = 2 + (i + 1) % kSides;
    mesh.triangles.push_back({0, next, here});
    mesh.triangles.push_back({1, here, next});
  }
  return mesh;
}

SurfaceProfile surface_of_cone(double radius, double height, const Vec3& place) {
  SmallModel heap;
  const uint32_t sand = heap.material(0, 0.7), shape = heap.box(Vec3::Ones());
  heap.model.shapes[shape].mesh = cone(radius, height);
  heap.body(shape, sand, place);
  heap.model.guide = cone(1, 1);
  for (Vec3& vertex : heap.model.guide.vertices) vertex += Vec3(7, 3, -2);
  return measure_surface(heap.model, heap.states(), 0.02);
}

// A cone as high as wide. After slumping to twice the plan it has half the height, half the tangent
// over the root of two as its slope, and the difference of the closed form.
TEST(Guide, SurfaceOfAConeFallsAsTheConeAndLessWhereItHasSlumped) {
  const Vec3 place(7, 3, -2);
  const SurfaceProfile whole = surface_of_cone(1, 1, place);
  EXPECT_NEAR(whole.difference, 0, 1e-9);
  EXPECT_NEAR(whole.slope_deg, 45, 0.7);
  EXPECT_DOUBLE_EQ(whole.slope_deg, whole.guide_slope_deg);
  EXPECT_NEAR(whole.rings[0].guide_height_m, 1 - 1 / 12.0, 0.02);  // the mean over a disk of 1/8

  const SurfaceProfile slumped = surface_of_cone(std::sqrt(2.0), 0.5, place);
  EXPECT_NEAR(slumped.slope_deg, degrees(std::atan(0.5 / std::sqrt(2.0))), 0.7);
  EXPECT_NEAR(slumped.guide_slope_deg, whole.guide_slope_deg, 1e-9);
  // The surfaces cross at r = (1 - 1/2) / (1 - 1 / sqrt(8)); the volume beyond equals that missing
  // within.
  const double r = 0.5 / (1 - 1 / std::sqrt(8.0));
  const double missing = r * r * (0.5 / 3);  // in pi, since the guide's volume is a third
  EXPECT_NEAR(slumped.difference, 2 * missing / (1 / 3.0), 0.04);

  // Shifted sideways it has the same slope elsewhere.
  EXPECT_GT(surface_of_cone(1, 1, place + Vec3(0.3, 0, 0)).difference, 0.25);
  // Below the guide's base there is no height.
  EXPECT_NEAR(surface_of_cone(1, 1, place - Vec3(0, 1, 0)).difference, 1, 1e-9);
}

}  // namespace
}  // namespace pilesim
