// Piles in containers and piles that are hit: small simulations.
#include <gtest/gtest.h>

#include "pile/repose/repose_director.h"
#include "simulate/modes/make_simulator.h"
#include "support/small_model.h"
#include "support/small_simulation.h"

namespace pilesim {
namespace {

constexpr double kBoxEdge = 0.2;

// A container 1 m wide and 0.4 m deep on the ground, with boxes that fall into it.
struct Container : SmallModel {
  explicit Container(int boxes, double turn = 0) {
    scene.frame_rate = 60;
    scene.step_s = 1.0 / 120;
    scene.piles = {
        {.angle = radians(40),
         .centre = GroundPoint(0, 0),
         .boundary = PileBoundary{{{-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}}, kRim}}};
    const uint32_t wood = material(0.1, 0.5);
    body(plane(), wood, Vec3::Zero(), Role::fixed);
    const uint32_t across = box({1.2, kRim, 0.1});
    const uint32_t along = box({0.1, kRim, 1.0});
    for (const double side : {-0.55, 0.55}) {
      body(across, wood, {0, kRim / 2, side}, Role::fixed);
      body(along, wood, {side, kRim / 2, 0}, Role::fixed);
    }
    const uint32_t shape = box(Vec3::Constant(kBoxEdge));
    first = static_cast<uint32_t>(model.bodies.size());
    for (int i = 0; i < boxes; ++i) {
      ModelBody& fallen = body(shape, wood, {0.1 * std::sin(i), 1.4, 0.1 * std::cos(2.0 * i)});
      fallen.pose.orientation =
          Quat(Eigen::AngleAxisd(turn + 0.7 * i, Vec3(1, i % 3, 1).normalized()));
      fallen.linear_velocity = {0, -3, 0};
      fallen.start_s = 0.08 * i;
    }
  }

  int outside(const BodyStates& states) const {
    int count = 0;
    for (uint32_t i = first; i < model.bodies.size(); ++i) {
      const Vec3& p = states.position[i];
      if (std::max(std::abs(p.x()), std::abs(p.z())) > 0.5) ++count;
    }
    return count;
  }

  // Number of bodies in the sides, or beyond them and below their rim without having come over it.
  // Call it in each frame; `came_over` is (body), empty at first.
  int beside(const BodyStates& states, std::vector<uint8_t>& came_over) const {
    came_over.resize(model.bodies.size(), 0);
    int count = 0;
    for (uint32_t i = first; i < model.bodies.size(); ++i) {
      const Vec3& p = states.position[i];
      if (std::max(std::abs(p.x()), std::abs(p.z())) <= 0.5) continue;
      if (p.y() >= kRim) came_over[i] = 1;
      if (came_over[i] == 0) ++count;
    }
    return count;
  }

  static constexpr double kRim = 0.4;
  uint32_t first = 0;
};

// 20 boxes fill at most 1 m x 1 m x 0.27 m at the density of loose boxes. One may tumble onto the
// rim by chance; none passes through the sides.
TEST(PileInAContainer, StaysInsideUntilItIsFull) {
  constexpr int kPiles = 6;
  int outside = 0;
  for (int pile = 0; pile < kPiles; ++pile) {
    const Container container(20, 0.1 * pile);
    ReposeDirector director(container.scene, container.model);
    const auto simulator = make_directed_simulator(container.scene, container.model, director);
    std::vector<uint8_t> came_over;
    FrameStatistics last;
    for (int frame = 0; frame < 300; ++frame) {
      last = simulator->step_frame();
      ASSERT_EQ(container.beside(simulator->states(), came_over), 0) << pile << ", frame " << frame;
    }
    outside += container.outside(simulator->states());
    EXPECT_LE(last.bodies_awake, 2) << pile;
    EXPECT_LE(director.piles()[0].ideal.reach_m(), director.piles()[0].shape->most_reach());
  }
  EXPECT_LE(outside, 2) << "of " << 20 * kPiles;
}

// The container and a pyramid of 40 degrees on top have 0.54 m^3. The surface with that shape is
// that of the boxes' tops, half an edge higher than the pyramid. Loose boxes fill more than half
// and less than three quarters of the remaining 0.44 m^3: 27 to 41 of 80 boxes.
TEST(PileInAContainer, RisesOverTheRimAndSpills) {
  constexpr int kPiles = 6;         // one box more or less on top is chance
  std::array<double, 5> surplus{};  // m, mean of the piles, at each 0.1 m from the centre
  for (int pile = 0; pile < kPiles; ++pile) {
    const Container container(80, 0.1 * pile);
    ReposeDirector director(container.scene, container.model);
    const auto simulator = make_directed_simulator(container.scene, container.model, director);
    run(*simulator, 480);
    double highest = 0;
    for (const Vec3& position : simulator->states().position) {
      highest = std::max(highest, position.y());
    }
    EXPECT_GT(highest, Container::kRim + kBoxEdge) << "a cone on top";
    EXPECT_LT(highest, 1.3) << "all have come down";
    const int inside = 80 - container.outside(simulator->states());
    EXPECT_GE(inside, 27);
    EXPECT_LE(inside, 41);
    const IdealSurface& ideal = director.piles()[0].ideal;
    for (size_t i = 0; i < surplus.size(); ++i) {
      surplus[i] += ideal.surplus_m(0.1 * static_cast<double>(i)) / kPiles;
    }
  }
  for (size_t i = 0; i < surplus.size(); ++i) {
    EXPECT_GT(surplus[i], -kBoxEdge / 4) << "a hollow at " << 0.1 * static_cast<double>(i);
  }
}

// On ice nothing takes momentum away: the woken boxes have the momentum that the ball loses.
TEST(PileThatIsHit, MomentumIsConserved) {
  SmallModel small;
  small.scene.frame_rate = 60;
  small.scene.step_s = 1.0 / 240;
  small.scene.piles = {{.angle = radians(35), .centre = GroundPoint(0, 0)}};
  const uint32_t ice = small.material(0.1, 0);
  const uint32_t iron = small.material(0.1, 0, 8000);
  small.body(small.plane(), ice, Vec3::Zero(), Role::fixed);
  const uint32_t shape = small.box(Vec3::Constant(kBoxEdge));
  for (const double x : {0.0, 0.3, 0.6}) small.body(shape, ice, {x, kBoxEdge / 2, 0});
  ModelBody& ball = small.body(small.sphere(kBoxEdge / 2), iron, {-4, kBoxEdge / 2, 0});
  ball.linear_velocity = {6, 0, 0};
  ball.start_s = 1.5;
  const double momentum = ball.mass_kg * 6;
  ReposeDirector director(small.scene, small.model);
  const auto simulator = make_directed_simulator(small.scene, small.model, director);
  const FrameStatistics before = run(*simulator, 80);
  ASSERT_EQ(before.bodies_awake, 0);
  run(*simulator, 65);
  EXPECT_GE(director.wakes_by_momentum(), 1);
  double after = 0;
  for (uint32_t i = 1; i < small.model.bodies.size(); ++i) {
    after += small.model.bodies[i].mass_kg * simulator->states().linear_velocity[i].x();
  }
  EXPECT_GT(simulator->states().linear_velocity[3].x(), 1) << "the last box moves";
  EXPECT_NEAR(after, momentum, 0.01 * momentum);
}

}  // namespace
}  // namespace pilesim
