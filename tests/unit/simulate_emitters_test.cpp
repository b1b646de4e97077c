// Emitters that stop once a region is full, and events that take the highest bodies.

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "core/parallel_for.h"
#include "core/state_stream.h"
#include "simulate/lifecycle.h"
#include "simulate/modes/make_simulator.h"
#include "support/small_model.h"
#include "support/small_simulation.h"

namespace pilesim {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr double kRadius = 0.05, kLevel = 0.3;
constexpr double kHalf = 0.2;   // of the container's inside
constexpr uint32_t kFixed = 5;  // ground and walls, which come first
constexpr uint32_t kPoured = 150;

// Ten balls a second into a container, until one lies with its centre above kLevel.
SmallModel jar(SimulatorMode mode) {
  SmallModel small;
  small.scene.simulator.mode = mode;
  small.scene.duration_s = 100;
  const uint32_t material = small.material(0, 0.3);
  small.body(small.plane(), material, Vec3::Zero(), Role::fixed);
  const double away = kHalf + 0.05;
  const uint32_t across = small.box({0.1, 1, 2 * away}), along = small.box({2 * away, 1, 0.1});
  small.body(across, material, {-away, 0.5, 0}, Role::fixed);
  small.body(across, material, {away, 0.5, 0}, Role::fixed);
  small.body(along, material, {0, 0.5, -away}, Role::fixed);
  small.body(along, material, {0, 0.5, away}, Role::fixed);
  const uint32_t ball = small.sphere(kRadius);
  small.model.shapes[ball].mesh = sphere_mesh(kRadius);
  for (uint32_t i = 0; i < kPoured; ++i) {
    const double angle = 2.4 * i, radius = 0.14 * std::sqrt(std::fmod(0.618 * i, 1.0));
    ModelBody& body =
        small.body(ball, material, {radius * std::cos(angle), 0.65, radius * std::sin(angle)});
    body.start_s = i == 0 ? kFromTheStart : 0.1 * i;
  }
  small.model.stops = {
      {{kFixed, kPoured}, "balls", Bounds(Vec3(-kHalf, kLevel, -kHalf), Vec3(kHalf, 1, kHalf))}};
  return small;
}

double highest_of(const BodyStates& states) {
  double highest_m = 0;
  for (size_t i = kFixed; i < states.size(); ++i) {
    if ((states.flags[i] & kPresent) != 0) highest_m = std::max(highest_m, states.position[i].y());
  }
  return highest_m;
}

// 40 balls a second at one place, where there is room for about 10 a second, for a second.
TEST(EmitterEnd, ThoseThatOthersKeptWaitingDoNotCome) {
  SmallModel small;
  small.scene.duration_s = 100;
  const uint32_t material = small.material(0, 0.3);
  small.body(small.plane(), material, Vec3::Zero(), Role::fixed);
  const uint32_t ball = small.sphere(kRadius);
  small.model.shapes[ball].mesh = sphere_mesh(kRadius);
  for (uint32_t i = 0; i < 40; ++i) {
    ModelBody& body = small.body(ball, material, {0, 2, 0});
    body.linear_velocity = {0, -1, 0};
    body.start_s = i == 0 ? kFromTheStart : 0.025 * i;
  }
  EmitterStop& stop = small.model.stops.emplace_back();
  stop.first = 1;
  stop.count = 40;
  stop.emitter = "nozzle";
  stop.end_s = 1;
  const auto simulator = make_simulator(small.scene, small.model);
  // The last of those in time may wait for half a step after the end, no more.
  const uint32_t came = run(*simulator, 61).bodies_present - 1;
  EXPECT_GT(came, 10u);
  EXPECT_LT(came, 30u);
  EXPECT_EQ(run(*simulator, 120).bodies_present, came + 1);
  EXPECT_EQ(simulator->life().stopped(), 40 - came);
  EXPECT_THAT(simulator->life().stops(),
              ElementsAre(HasSubstr("'nozzle' stopped at its end_s, with others in the place: " +
                                    std::to_string(came) + " of 40 bodies came")));
  EXPECT_THAT(simulator->notes(), ElementsAre(HasSubstr("appeared late")));
}

class FullRegion : public ::testing::TestWithParam<SimulatorMode> {
 protected:
  ~FullRegion() override { set_thread_count(available_threads()); }
};

TEST_P(FullRegion, StopsWithinABodyOfItsHeight) {
  const SmallModel small = jar(GetParam());
  const auto simulator = make_simulator(small.scene, small.model);
  EXPECT_NEAR(simulator->life().last_start_s(), 0.1 * (kPoured - 1), 1e-9);
  run(*simulator, 60 * 9);
  const uint32_t came = simulator->statistics().bodies_present - kFixed;
  // Loosest and densest packings of balls: 0.5 and 0.74 of the volume, and a layer more.
  const double volume = 4 * kHalf * kHalf / (4 * kPi / 3 * std::pow(kRadius, 3));
  EXPECT_GT(came, 0.5 * volume * kLevel);
  EXPECT_LT(came, 0.74 * volume * (kLevel + 3 * kRadius));
  EXPECT_GT(highest_of(simulator->states()), kLevel - 2 * kRadius);
  EXPECT_LT(highest_of(simulator->states()), kLevel + 2 * kRadius);
  EXPECT_EQ(simulator->life().stopped(), kPoured - came);
  EXPECT_THAT(simulator->life().stops(),
              ElementsAre(HasSubstr("'balls' stopped when its region was full: " +
                                    std::to_string(came) + " of 150 bodies came")));
  EXPECT_THAT(simulator->notes(), IsEmpty());
  EXPECT_NEAR(simulator->life().last_start_s(), 0.1 * (came - 1), 1e-9);
  // Nobody comes any more.
  EXPECT_EQ(run(*simulator, 60).bodies_present, came + kFixed);
}

TEST_P(FullRegion, StopsAlikeAtAnyNumberOfThreadsAndOverACheckpoint) {
  const SmallModel small = jar(GetParam());
  set_thread_count(1);
  const auto simulator = make_simulator(small.scene, small.model);
  std::vector<std::vector<std::byte>> saved;
  while (simulator->life().stopped() == 0 && saved.size() < 60 * 9) {
    StateWriter writer;
    simulator->save(writer);
    saved.emplace_back(writer.bytes().begin(), writer.bytes().end());
    simulator->step_frame();
  }
  ASSERT_GT(simulator->life().stopped(), 0u);
  run(*simulator, 30);
  set_thread_count(2);
  // While it is counted how long a body has been slow, and long before.
  for (const size_t ago : {size_t{1}, size_t{2}, size_t{4}, saved.size()}) {
    const auto again = make_simulator(small.scene, small.model);
    StateReader reader(saved[saved.size() - ago]);
    again->load(reader);
    run(*again, static_cast<int>(ago) + 30);
    EXPECT_EQ(simulator->life().stops(), again->life().stops()) << ago;
    EXPECT_EQ(simulator->states().position, again->states().position) << ago;
    EXPECT_EQ(simulator->states().flags, again->states().flags) << ago;
  }
}

INSTANTIATE_TEST_SUITE_P(Modes, FullRegion,
                         ::testing::Values(SimulatorMode::impulse, SimulatorMode::particle));

TEST(EmptyRegion, IsNotFullOfBodiesThatPassOrBounce) {
  SmallModel small;
  small.scene.duration_s = 100;
  const uint32_t material = small.material(1, 0);
  small.body(small.plane(), material, Vec3::Zero(), Role::fixed);
  const uint32_t ball = small.sphere(0.1);
  for (int i = 0; i < 4; ++i) {
    small.body(ball, material, {0.5 * i, 2, 0}).start_s = i == 0 ? kFromTheStart : i;
  }
  small.model.stops = {{{1, 4}, "balls", Bounds(Vec3(-1, 0.5, -1), Vec3(3, 3, 1))}};
  const auto simulator = make_simulator(small.scene, small.model);
  run(*simulator, 60 * 4);
  EXPECT_EQ(simulator->statistics().bodies_present, 5u);
  EXPECT_EQ(simulator->life().stopped(), 0u);
  EXPECT_THAT(simulator->life().stops(), IsEmpty());
}

class Highest : public ::testing::TestWithParam<SimulatorMode> {
 protected:
  // Balls that fall beside each other from these heights, after the ground.
  static SmallModel falling(const std::vector<double>& heights_m) {
    SmallModel small;
    small.scene.simulator.mode = GetParam();
    small.scene.duration_s = 100;
    const uint32_t material = small.material(0, 0.5);
    small.body(small.plane(), material, Vec3::Zero(), Role::fixed);
    const uint32_t ball = small.sphere(0.1);
    small.model.shapes[ball].mesh = sphere_mesh(0.1);
    for (size_t i = 0; i < heights_m.size(); ++i) {
      small.body(ball, material, {0.5 * static_cast<double>(i), heights_m[i], 0});
    }
    return small;
  }
  static std::vector<uint32_t> present(const Simulator& simulator) {
    std::vector<uint32_t> bodies;
    for (uint32_t i = 1; i < simulator.states().size(); ++i) {
      if ((simulator.states().flags[i] & kPresent) != 0) bodies.push_back(i);
    }
    return bodies;
  }
};

TEST_P(Highest, AreThoseThatAreThereThen) {
  SmallModel small = falling({5, 9, 7, 8, 6, 9});
  small.model.bodies[2].start_s = 10;  // not there yet
  small.model.bodies[4].held = true;   // not free
  small.model.events = {{.time_s = 0.1, .kind = ModelEvent::Kind::remove, .highest = 2}};
  const auto simulator = make_simulator(small.scene, small.model);
  run(*simulator, 5);
  EXPECT_THAT(present(*simulator), ElementsAre(1, 3, 4, 5, 6));
  run(*simulator, 5);
  EXPECT_THAT(present(*simulator), ElementsAre(1, 4, 5));
}

TEST_P(Highest, OfBodiesThatAreLevelTheFirstGo) {
  SmallModel small = falling({3, 3, 3, 3});
  small.model.events = {{.time_s = 0.1, .kind = ModelEvent::Kind::remove, .highest = 1},
                        {.time_s = 0.2, .kind = ModelEvent::Kind::remove, .highest = 1},
                        {.time_s = 0.3, .kind = ModelEvent::Kind::remove, .highest = 9}};
  const auto simulator = make_simulator(small.scene, small.model);
  run(*simulator, 10);
  EXPECT_THAT(present(*simulator), ElementsAre(2, 3, 4));
  run(*simulator, 5);
  EXPECT_THAT(present(*simulator), ElementsAre(3, 4));
  run(*simulator, 10);
  EXPECT_THAT(present(*simulator), IsEmpty());
}

TEST_P(Highest, LeaveThoseBelowThemToSettleAgain) {
  SmallModel small = falling({0.1, 0.1});
  small.model.bodies[2].pose.position = {0.02, 0.3, 0};  // on the first
  small.model.events = {{.time_s = 3, .kind = ModelEvent::Kind::remove, .highest = 1}};
  const auto simulator = make_simulator(small.scene, small.model);
  run(*simulator, 60 * 3 - 1);
  EXPECT_EQ(present(*simulator).size(), 2u);
  run(*simulator, 30);
  ASSERT_EQ(present(*simulator).size(), 1u);
  EXPECT_NEAR(simulator->states().position[present(*simulator)[0]].y(), 0.1, 0.01);
}

INSTANTIATE_TEST_SUITE_P(Modes, Highest,
                         ::testing::Values(SimulatorMode::impulse, SimulatorMode::particle));

// More than one a frame, each where the one before has just left.
TEST(Streams, HaveTheirRateWhateverTheFrames) {
  constexpr double kRate = 97, kSpeed = 5, kBall = 0.02;
  constexpr double kLate = 1.01 * kSpeed / (16 * 60);  // m: a sixteenth of a frame
  SmallModel m;
  m.scene.step_s.reset();
  const uint32_t material = m.material(0, 0), ball = m.sphere(kBall);
  m.model.shapes[ball].mesh = sphere_mesh(kBall);
  for (int i = 0; i < 60; ++i) {
    ModelBody& body = m.body(ball, material, {0, 2, 0});
    body.linear_velocity = {kSpeed, 0, 0};
    body.start_s = i == 0 ? kFromTheStart : i / kRate;
  }
  const auto simulator = make_simulator(m.scene, m.model);
  run(*simulator, 45);
  const BodyStates& states = simulator->states();
  for (size_t i = 0; i < states.size(); ++i) {
    ASSERT_TRUE((states.flags[i] & kPresent) != 0) << i;
    EXPECT_NEAR(states.position[i].x(), kSpeed * (0.75 - static_cast<double>(i) / kRate), kLate)
        << i;
  }
  EXPECT_THAT(simulator->notes(), IsEmpty());
}

TEST(Events, HappenAtTheirTime) {
  for (const double frame_rate : {10.0, 24.0, 60.0}) {
    SmallModel m;
    m.scene.step_s.reset();
    m.scene.frame_rate = frame_rate;
    m.scene.gravity = Vec3::Zero();
    const uint32_t box = m.box(Vec3::Constant(0.1));
    const double mass = m.body(box, m.material(0, 0), {0, 1, 0}).mass_kg;
    m.model.events = {{.time_s = 0.777,
                       .kind = ModelEvent::Kind::impulse,
                       .bodies = {0},
                       .impulse = Vec3(mass, 0, 0)}};
    const auto simulator = make_simulator(m.scene, m.model);
    run(*simulator, static_cast<int>(2 * frame_rate));
    EXPECT_NEAR(simulator->states().position[0].x(), 2 - 0.777, 1e-6) << frame_rate;
  }
}

}  // namespace
}  // namespace pilesim
