// Piles of the mixed mode: of solved bodies, of spheres, and of both.
#include <gtest/gtest.h>

#include "simulate/modes/make_simulator.h"
#include "support/boxes_onto_a_pile.h"
#include "support/small_simulation.h"

namespace pilesim {
namespace {

// Spheres among themselves; pairs near must-impulse bodies are solved.
struct MixedBoxes : BoxesOntoAPile {
  explicit MixedBoxes(int boxes, double angle_deg = 35) : BoxesOntoAPile(boxes, angle_deg) {
    scene.simulator.mode = SimulatorMode::mixed;
    scene.simulator.detail.levels = {{.near_near = PairMethod::impulse,
                                      .near_far = PairMethod::particle,
                                      .far_far = PairMethod::particle}};
  }
  void solve_every(size_t other) {
    for (size_t i = 0; i < model.bodies.size(); i += other) {
      model.bodies[i].preference = Preference::must_impulse;
    }
  }
};

// The ground is body 0.
class MixedPilesOf : public testing::TestWithParam<size_t> {};

TEST_P(MixedPilesOf, ComeToRestAndNothingHangsOrOverlaps) {
  MixedBoxes boxes(60);
  if (GetParam() > 0) boxes.solve_every(GetParam());
  MeasuringDirector measuring(boxes);
  const auto simulator = make_directed_simulator(boxes.scene, boxes.model, measuring);
  const FrameStatistics statistics = run(*simulator, 540);
  EXPECT_LE(statistics.bodies_awake, 4);
  const PlausibilityCounts& counts = measuring.director.plausibility();
  EXPECT_GE(counts.asleep, 56);
  EXPECT_EQ(counts.hanging, 0);
  EXPECT_EQ(counts.inside, 0);
}

TEST(MixedPiles, OfMustImpulseBodiesAreThoseOfTheImpulseMode) {
  MixedBoxes boxes(20);
  boxes.solve_every(1);
  boxes.scene.step_s = Scene::kFixedStep;
  std::vector<Vec3> impulse;
  for (const SimulatorMode mode : {SimulatorMode::impulse, SimulatorMode::mixed}) {
    boxes.scene.simulator.mode = mode;
    ReposeDirector director(boxes.scene, boxes.model);
    const auto simulator = make_directed_simulator(boxes.scene, boxes.model, director);
    run(*simulator, 150);
    if (mode == SimulatorMode::impulse) impulse = simulator->states().position;
    EXPECT_EQ(simulator->states().position, impulse);
  }
}

// A body that slept as a sphere and comes near the camera is solved from then on; a solved body
// stays so while it sleeps.
TEST(MixedPiles, SleepersStayWhereTheyAreWhenTheirLevelChanges) {
  for (const bool approaches : {true, false}) {
    MixedBoxes boxes(60);
    boxes.scene.simulator.detail.levels.push_back(boxes.scene.simulator.detail.levels[0]);
    boxes.scene.simulator.detail.levels[0].exact = true;
    boxes.scene.simulator.detail.levels[1].near_near = PairMethod::particle;
    boxes.scene.simulator.detail.distances_m = {6};
    const Vec3 from(0, 0, approaches ? 9 : 3), to(0, 0, approaches ? 3 : 9);
    boxes.scene.camera.keys = {{.time_s = 13, .position = from, .target = {0, 0, 0}},
                               {.time_s = 13.5, .position = to, .target = {0, 0, 0}}};
    MeasuringDirector measuring(boxes);
    const auto simulator = make_directed_simulator(boxes.scene, boxes.model, measuring);
    EXPECT_EQ(run(*simulator, 775).bodies_awake, 0);
    const BodyStates before = simulator->states();
    EXPECT_EQ((before.flags[1] & kImpulse) == 0, approaches);
    for (int frame = 0; frame < 90; ++frame) {
      EXPECT_EQ(simulator->step_frame().bodies_awake, 0);
      EXPECT_EQ(measuring.director.plausibility().hanging, 0);
      EXPECT_EQ(measuring.director.plausibility().inside, 0);
    }
    EXPECT_TRUE(simulator->states().flags[1] & kImpulse);
    for (uint32_t i = 1; i < before.size(); ++i) {
      EXPECT_LT((simulator->states().position[i] - before.position[i]).norm(), 1e-6) << i;
    }
  }
}

// Sixty are too few for a slope.
TEST_P(MixedPilesOf, TakeTheAngle) {
  for (const double angle_deg : {20.0, 40.0}) {
    MixedBoxes boxes(150, angle_deg);
    if (GetParam() > 0) boxes.solve_every(GetParam());
    MeasuringDirector measuring(boxes);
    const auto simulator = make_directed_simulator(boxes.scene, boxes.model, measuring);
    run(*simulator, 1080);
    EXPECT_NEAR(degrees(measuring.director.piles()[0].slope.angle), angle_deg, 4);
  }
}

INSTANTIATE_TEST_SUITE_P(SolvedEvery, MixedPilesOf, testing::Values(0, 1, 2, 7),
                         testing::PrintToStringParamName());

}  // namespace
}  // namespace pilesim
