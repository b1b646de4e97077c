// Stock Bullet as a second opinion: closed forms as far as it satisfies them, and reproducible
// bytes.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/parallel_for.h"
#include "simulate/modes/make_simulator.h"
#include "support/mesh_grid.h"
#include "support/small_model.h"
#include "support/small_simulation.h"

namespace pilesim {
namespace {

using test::kGravity;
constexpr double kStep = 1.0 / 240;

struct BulletModel : SmallModel {
  BulletModel() { scene.simulator.engine = EngineKind::bullet; }

  uint32_t ground(double restitution, double friction) {
    const uint32_t stuff = material(restitution, friction);
    body(plane(), stuff, Vec3::Zero(), Role::fixed);
    return stuff;
  }
  std::unique_ptr<Simulator> start() const { return make_simulator(scene, model); }
};

// Bullet's integration: the velocity at the end of a step moves a body during the whole step.
TEST(Bullet, FallsFreelyButForItsStep) {
  BulletModel m;
  m.body(m.sphere(0.1), m.material(0, 0), {0, 10, 0}).linear_velocity = {3, 4, -1};
  const auto simulator = m.start();
  run(*simulator, 60);
  const Vec3 exact = Vec3(0, 10, 0) + Vec3(3, 4, -1) - Vec3(0, kGravity / 2, 0);
  const Vec3 behind(0, -kGravity * kStep / 2, 0);
  EXPECT_LT((simulator->states().position[0] - exact - behind).norm(), 1e-9);
}

TEST(Bullet, BoxesRestOnAPlaneAndOnEachOtherAndSleep) {
  for (const double size : {0.02, 1.0}) {
    BulletModel m;
    const uint32_t wood = m.ground(0.3, 0.5), box = m.box({size, size, size});
    for (int i = 0; i < 2; ++i) m.body(box, wood, {0, (0.51 + 1.01 * i) * size, 0});
    const auto simulator = m.start();
    EXPECT_EQ(run(*simulator, 240).bodies_awake, 0) << size;
    for (int i = 0; i < 2; ++i) {
      EXPECT_NEAR(simulator->states().position[i + 1].y(), (0.5 + i) * size, 0.01 * size);
      EXPECT_NE(simulator->states().flags[i + 1] & kAsleep, 0);
    }
  }
}

TEST(Bullet, ATowerOfTwentyBoxesStands) {
  BulletModel m;
  const uint32_t wood = m.ground(0.1, 0.5), box = m.box({0.1, 0.1, 0.1});
  for (int i = 0; i < 20; ++i) m.body(box, wood, {0, 0.05 + 0.1 * i, 0});
  const auto simulator = m.start();
  run(*simulator, 300);
  const Vec3& top = simulator->states().position[20];
  EXPECT_NEAR((top - Vec3(0, 1.95, 0)).norm(), 0, 0.01);
}

TEST(Bullet, ABoxSlidesByCoulomb) {
  BulletModel m;
  const uint32_t wood = m.ground(0, 0.4);
  m.body(m.box({1, 0.2, 1}), wood, {0, 0.1, 0}).linear_velocity = {2, 0, 2};
  const auto simulator = m.start();
  run(*simulator, 120);
  const double way = 8 / (2 * 0.4 * kGravity);
  EXPECT_NEAR(simulator->states().position[1].x(), way / std::sqrt(2), 0.02 * way);
  EXPECT_NEAR(simulator->states().position[1].z(), way / std::sqrt(2), 0.02 * way);
}

TEST(Bullet, FrictionHoldsABoxOnASlopeBelowItsAngleOnly) {
  for (const double angle : {0.3, 0.5}) {
    BulletModel m;
    const double friction = std::tan(0.4);
    m.scene.gravity = kGravity * Vec3(std::sin(angle), -std::cos(angle), 0);
    m.body(m.box({1, 0.2, 1}), m.ground(0, friction), {0, 0.1, 0});
    const auto simulator = m.start();
    run(*simulator, 60);
    const double way = kGravity * (std::sin(angle) - friction * std::cos(angle)) / 2;
    EXPECT_NEAR(simulator->states().position[1].x(), std::max(0.0, way), 0.02) << angle;
  }
}

double height_of_bounce(double radius, double restitution, double drop) {
  BulletModel m;
  const uint32_t rubber = m.ground(restitution, 0);
  m.body(m.sphere(radius), rubber, {0, radius + drop, 0});
  const auto simulator = m.start();
  double top = 0;
  bool has_bounced = false;
  for (int i = 0; i < 240; ++i) {
    simulator->step_frame();
    const BodyStates& states = simulator->states();
    has_bounced = has_bounced || states.linear_velocity[1].y() > 0;
    if (!has_bounced) continue;
    if (states.linear_velocity[1].y() < 0) break;
    top = std::max(top, states.position[1].y() - radius);
  }
  return top;
}

TEST(Bullet, ABallBouncesByItsRestitution) {
  for (const double restitution : {0.3, 0.6, 0.9}) {
    EXPECT_NEAR(height_of_bounce(0.1, restitution, 1), restitution * restitution, 0.05);
  }
  EXPECT_LT(height_of_bounce(0.1, 0, 1), 0.01);
  // Fast enough for continuous collision detection.
  EXPECT_NEAR(height_of_bounce(0.01, 0.5, 1), 0.25, 0.05);
}

TEST(Bullet, AHingedRodSwingsByThePendulumsPeriod) {
  BulletModel m;
  const double length = 1;
  ModelBody& rod = m.body(m.box({length, 0.02, 0.02}), m.material(0, 0), {0, -length / 2, 0});
  const double amplitude = 0.1;
  const Quat turn(Eigen::AngleAxisd(amplitude - kPi / 2, Vec3::UnitZ()));
  rod.pose.orientation = turn;
  rod.pose.position = turn * Vec3(length / 2, 0, 0);
  rod.hinge = Hinge{.axis = Vec3::UnitZ(), .anchor = Vec3::Zero()};
  m.scene.frame_rate = 240;
  const auto simulator = m.start();
  const double period =
      2 * kPi * std::sqrt(2 * length / (3 * kGravity)) * (1 + amplitude * amplitude / 16);
  std::vector<double> crossings;
  double before = amplitude;
  for (int i = 1; i <= 240 * 6; ++i) {
    simulator->step_frame();
    const Vec3& place = simulator->states().position[0];
    EXPECT_NEAR(place.norm(), length / 2, 1e-3);
    if (before > 0 && place.x() <= 0) crossings.push_back(i * kStep);
    before = place.x();
  }
  ASSERT_GE(crossings.size(), 3);
  const double mean =
      (crossings.back() - crossings.front()) / static_cast<double>(crossings.size() - 1);
  EXPECT_NEAR(mean, period, 0.005 * period);
}

TEST(Bullet, AKinematicBodyCarriesWhatLiesOnIt) {
  BulletModel m;
  const uint32_t wood = m.material(0, 0.8), board = m.box({2, 0.2, 2});
  ModelBody& lift = m.body(board, wood, Vec3::Zero(), Role::kinematic);
  lift.motion = {{.time_s = 0}, {.time_s = 1}, {.time_s = 3, .pose = {{1, 0.5, 0}}}};
  lift.motion.interpolation = Interpolation::smooth;
  m.body(m.box({0.2, 0.2, 0.2}), wood, {0, 0.2, 0});
  const auto simulator = m.start();
  run(*simulator, 240);
  EXPECT_NEAR(simulator->states().position[0].x(), 1, 1e-9);
  EXPECT_NEAR(simulator->states().position[1].x(), 1, 0.02);
  EXPECT_NEAR(simulator->states().position[1].y(), 0.7, 0.005);
  EXPECT_EQ(run(*simulator, 180).bodies_awake, 0) << "the board stands again";
}

TEST(Bullet, OnABoardThatTiltsABoxSlidesFromTheAngleOfFrictionOn) {
  BulletModel m;
  const uint32_t wood = m.material(0, 0.2);
  ModelBody& board = m.body(m.box({4, 0.2, 4}), wood, {0, -0.1, 0}, Role::kinematic);
  board.motion = {{.time_s = 0, .pose = board.pose}, {.time_s = 5, .pose = board.pose}};
  board.motion[1].pose.orientation = Eigen::AngleAxisd(0.5, Vec3::UnitZ());
  m.body(m.box({0.2, 0.2, 0.2}), wood, {0, 0.1, 0});
  const auto simulator = m.start();
  double slides_at = 0;
  for (int frame = 1; frame <= 300 && slides_at == 0; ++frame) {
    simulator->step_frame();
    const BodyStates& states = simulator->states();
    const Vec3 place =
        states.orientation[0].conjugate() * (states.position[1] - states.position[0]);
    if (std::abs(place.x()) > 0.02) slides_at = 0.1 * frame / 60;
  }
  // It reaches that by an acceleration proportional to the angle, 0.1 rad in a second.
  const double until_seen_s = std::cbrt(6 * 0.02 / (0.1 * kGravity));
  EXPECT_NEAR(slides_at, std::atan(0.2) + 0.1 * until_seen_s, 0.01);
}

TEST(Bullet, ATriangleSurfaceHoldsABoxAndABallAndAHull) {
  BulletModel m;
  const uint32_t wood = m.material(0.2, 0.6);
  ModelShape ground;
  add_mesh_grid({-1, 0, -1}, {0, 0, 2}, {2, 0, 0}, 8, ground.mesh);
  ground.collides_as_mesh = true;
  ground.smallest_extent = 2;
  m.model.shapes.push_back(ground);
  m.body(0, wood, Vec3::Zero(), Role::fixed);
  const double half = 0.1;
  std::vector<Vec3> corners;
  for (int i = 0; i < 8; ++i) {
    corners.emplace_back(half * ((i & 1) * 2 - 1), half * ((i & 2) - 1), half * ((i & 4) / 2 - 1));
  }
  m.body(m.box(Vec3::Constant(2 * half)), wood, {-0.5, 0.2, 0.03});
  m.body(m.sphere(half), wood, {0.03, 0.2, 0.03});
  m.body(m.hull(corners), wood, {0.5, 0.2, 0.03});
  const auto simulator = m.start();
  run(*simulator, 180);
  for (int i = 1; i <= 3; ++i) {
    EXPECT_NEAR(simulator->states().position[i].y(), half, 0.005) << i;
  }
}

// Two boxes side by side whose inertia is not diagonal in the body frame: an L on its back.
TEST(Bullet, ACompoundLiesOnItsPieces) {
  BulletModel m;
  const uint32_t wood = m.ground(0.2, 0.6);
  ModelShape shape;
  shape.mass = box_mass_properties({0.6, 0.2, 0.2});
  const Quat turn(Eigen::AngleAxisd(0.5, Vec3(1, 2, 3).normalized()));
  const Mat3 axes = turn.toRotationMatrix();
  shape.mass.inertia_m5 = axes * shape.mass.inertia_m5 * axes.transpose();
  for (const double side : {-1.0, 1.0}) {
    shape.pieces.push_back(
        {CollisionPiece::Kind::box, {turn * Vec3(0.15 * side, 0, 0), turn}, {0.3, 0.2, 0.2}, {}});
  }
  shape.bounding_radius = 0.34;
  shape.smallest_extent = 0.2;
  m.model.shapes.push_back(shape);
  m.body(1, wood, {0, 0.12, 0}).pose.orientation = turn.conjugate();
  const auto simulator = m.start();
  EXPECT_EQ(run(*simulator, 240).bodies_awake, 0);
  const BodyStates& states = simulator->states();
  EXPECT_NEAR(states.position[1].y(), 0.1, 0.002);
  EXPECT_LT(states.orientation[1].angularDistance(turn.conjugate()), 0.01);
}

TEST(Bullet, FastBodiesDoNotPassAThinWall) {
  BulletModel m;
  const uint32_t steel = m.material(0.5, 0.3);
  m.body(m.box({0.02, 2, 2}), steel, {0, 0, 0}, Role::fixed);
  m.body(m.sphere(0.02), steel, {-2, 0.3, 0}).linear_velocity = {50, 0, 0};
  const auto simulator = m.start();
  run(*simulator, 12);
  EXPECT_LT(simulator->states().position[1].x(), 0);
}

TEST(Bullet, SleepersWakeWhenWhatCarriesThemGoesOrSomethingHitsThem) {
  BulletModel m;
  const uint32_t wood = m.ground(0.2, 0.5), box = m.box({0.2, 0.2, 0.2});
  for (int i = 0; i < 2; ++i) m.body(box, wood, {0, 0.1 + 0.2 * i, 0}).asleep = true;
  m.body(box, wood, {3, 0.1, 0}).asleep = true;
  ModelBody& thrown = m.body(m.sphere(0.1), wood, {2, 0.1, 0});
  thrown.linear_velocity = {4, 0, 0};
  m.model.events.push_back({.time_s = 0.5, .kind = ModelEvent::Kind::remove, .bodies = {1}});
  const auto simulator = m.start();
  EXPECT_EQ(simulator->statistics().bodies_awake, 1);
  const BodyStates& states = simulator->states();
  run(*simulator, 10);
  EXPECT_EQ(states.position[3].x(), 3);
  run(*simulator, 20);
  EXPECT_NEAR(states.position[2].y(), 0.3, 1e-3);
  EXPECT_GT(states.position[3].x(), 3.01);
  EXPECT_EQ(run(*simulator, 40).bodies_present, 4);
  EXPECT_NEAR(states.position[2].y(), 0.1, 0.005);
}

TEST(Bullet, AHeldBodyWaitsAndAnImpulseMoves) {
  BulletModel m;
  m.scene.gravity.setZero();
  ModelBody& held = m.body(m.sphere(0.1), m.material(0, 0), Vec3::Zero());
  held.held = true;
  held.linear_velocity = {1, 0, 0};
  const double mass = held.mass_kg;
  m.model.events.push_back({.time_s = 0.5, .kind = ModelEvent::Kind::release, .bodies = {0}});
  m.model.events.push_back(
      {.time_s = 1, .kind = ModelEvent::Kind::impulse, .bodies = {0}, .impulse = {0, 2 * mass, 0}});
  const auto simulator = m.start();
  run(*simulator, 30);
  EXPECT_EQ(simulator->states().position[0].x(), 0);
  run(*simulator, 60);
  EXPECT_NEAR((simulator->states().position[0] - Vec3(1, 1, 0)).norm(), 0, 1e-6);
}

BulletModel heap() {
  BulletModel m;
  const uint32_t wood = m.ground(0.3, 0.5);
  const uint32_t shapes[] = {m.box({0.2, 0.2, 0.2}), m.sphere(0.1), m.cylinder(0.1, 0.2),
                             m.hull({{0.1, 0, 0}, {-0.1, 0, 0}, {0, 0.1, 0}, {0, 0, 0.1}})};
  for (int i = 0; i < 48; ++i) {
    const Vec3 place(0.21 * (i % 3), 0.15 + 0.25 * (i / 9), 0.21 * (i / 3 % 3));
    m.body(shapes[i % 4], wood, place).start_s = i < 40 ? kFromTheStart : 0.5;
  }
  return m;
}

TEST(Bullet, GivesTheSameBytesAgainAtAnyNumberOfThreadsAndResumed) {
  const BulletModel m = heap();
  const auto first = m.start();
  set_thread_count(1);
  run(*first, 45);
  StateWriter half;
  first->save(half);
  run(*first, 45);
  set_thread_count(2);
  // Between the two, the addresses of Bullet's allocations change.
  const std::vector<std::unique_ptr<Simulator>> others = [&] {
    std::vector<std::unique_ptr<Simulator>> made;
    for (int i = 0; i < 3; ++i) made.push_back(m.start());
    made.erase(made.begin() + 1);
    return made;
  }();
  const auto again = m.start();
  StateReader reader(half.bytes());
  again->load(reader);
  run(*again, 45);
  set_thread_count(available_threads());
  for (size_t i = 0; i < m.model.bodies.size(); ++i) {
    EXPECT_EQ(first->states().position[i], again->states().position[i]) << i;
    EXPECT_EQ(first->states().orientation[i].coeffs(), again->states().orientation[i].coeffs());
  }
}

}  // namespace
}  // namespace pilesim
