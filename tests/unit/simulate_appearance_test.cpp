// Bodies that appear after the start wait until no moving body occupies their place.

#include <gmock/gmock.h>

#include "core/state_stream.h"
#include "simulate/modes/make_simulator.h"
#include "support/small_model.h"

namespace pilesim {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Balls of radius 0.1 from a point `height` above the ground, `rate_hz` per second.
SmallModel tap(double height, double rate_hz, int count,
               SimulatorMode mode = SimulatorMode::impulse) {
  SmallModel small;
  small.scene.simulator.mode = mode;
  small.scene.duration_s = 100;
  const uint32_t material = small.material(0, 0.5);
  small.body(small.plane(), material, Vec3::Zero(), Role::fixed);
  const uint32_t ball = small.sphere(0.1);
  small.model.shapes[ball].mesh = sphere_mesh(0.1);
  for (int i = 0; i < count; ++i) {
    small.body(ball, material, {0, height, 0}).start_s = i / rate_hz;
  }
  return small;
}

// The least distance between the centres of any two present bodies.
double nearest(const Simulator& simulator) {
  const BodyStates& states = simulator.states();
  double nearest_m = 1e9;
  for (size_t i = 1; i < states.size(); ++i) {
    for (size_t j = 1; j < i; ++j) {
      if ((states.flags[i] & states.flags[j] & kPresent) == 0) continue;
      nearest_m = std::min(nearest_m, (states.position[i] - states.position[j]).norm());
    }
  }
  return nearest_m;
}

class Appearance : public ::testing::TestWithParam<SimulatorMode> {};

TEST_P(Appearance, NobodyComesInsideAnother) {
  // In 1/50 s a ball has fallen 2 mm of its 200.
  const SmallModel small = tap(2, 50, 12, GetParam());
  const auto simulator = make_simulator(small.scene, small.model);
  uint32_t most = 0;
  for (int frame = 0; frame < 40; ++frame) {
    most = std::max(most, simulator->step_frame().bodies_present);
    // Bodies on others may be pressed in by the solvers' own tolerance.
    EXPECT_GT(nearest(*simulator), 0.19) << frame;
  }
  EXPECT_GT(most, 2u);
  EXPECT_LT(most, 13u);  // a ball leaves its place in 0.2 s
  EXPECT_THAT(simulator->notes(), ElementsAre(HasSubstr("appeared late"), HasSubstr("never")));
}

INSTANTIATE_TEST_SUITE_P(Modes, Appearance,
                         ::testing::Values(SimulatorMode::impulse, SimulatorMode::particle));

TEST(AppearanceTime, IsWhenTheOneBeforeHasLeft) {
  const SmallModel small = tap(50, 1000, 2);
  const auto simulator = make_simulator(small.scene, small.model);
  // A ball falls its diameter in sqrt(2 * 0.2 / 9.81) = 0.2019 s, and 48 steps are 0.2 s.
  int frames = 0;
  while (simulator->statistics().bodies_present < 3 && frames < 60) {
    simulator->step_frame();
    ++frames;
  }
  EXPECT_GE(frames, 12);
  EXPECT_LE(frames, 13);
}

TEST(AppearanceTime, IsTheScenesWhereThereIsRoom) {
  const SmallModel small = tap(50, 4, 5);
  const auto simulator = make_simulator(small.scene, small.model);
  for (int frame = 0; frame < 61; ++frame) simulator->step_frame();
  EXPECT_EQ(simulator->statistics().bodies_present, 6u);
  EXPECT_THAT(simulator->notes(), IsEmpty());
}

TEST(AppearanceTime, BodiesThatNeverFindRoomAreNamed) {
  const SmallModel small = tap(0.15, 10, 4);
  const auto simulator = make_simulator(small.scene, small.model);
  for (int frame = 0; frame < 90; ++frame) simulator->step_frame();
  EXPECT_EQ(simulator->statistics().bodies_present, 2u);
  EXPECT_THAT(simulator->notes(), ElementsAre(AllOf(HasSubstr("3 bodies never appeared"),
                                                    HasSubstr("'body/2' is the first"))));
}

TEST(AppearanceTime, StandsInTheState) {
  const SmallModel small = tap(2, 50, 12);
  const auto simulator = make_simulator(small.scene, small.model);
  for (int frame = 0; frame < 20; ++frame) simulator->step_frame();
  StateWriter writer;
  simulator->save(writer);
  const auto again = make_simulator(small.scene, small.model);
  StateReader reader(writer.bytes());
  again->load(reader);
  for (int frame = 0; frame < 20; ++frame) {
    simulator->step_frame();
    again->step_frame();
  }
  EXPECT_EQ(simulator->notes(), again->notes());
  EXPECT_EQ(simulator->states().position, again->states().position);
}

}  // namespace
}  // namespace pilesim
