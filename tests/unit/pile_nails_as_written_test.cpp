// Section 6.2 of the dissertation to the letter: the analysis of one body, and nails.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "core/philox.h"
#include "pile/guide/guided_simulator.h"
#include "pile/guide/nail_director.h"
#include "support/small_model.h"

namespace pilesim {
namespace {

constexpr double kCube = 0.2;

// A slope with this friction and `slope` = tan that falls along `azimuth` in the plane of the
// tangents, under a body with its four contacts.
struct Incline {
  Incline(double slope, double azimuth, double friction) {
    const Vec3 normal = Vec3::UnitY(), t1 = normal.unitOrthogonal(), t2 = normal.cross(t1);
    const Vec3 along = std::cos(azimuth) * t1 + std::sin(azimuth) * t2;
    up = (normal + slope * along).normalized();
    for (const double x : {-1.0, 1.0}) {
      for (const double z : {-1.0, 1.0}) contacts.push_back({x * t1 + z * t2, normal, friction});
    }
  }
  Vec3 up;
  std::vector<SupportPoint> contacts;
};

bool stands(const Incline& incline, const Vec3& centre = Vec3::Zero()) {
  ForcePyramids pyramids;
  return pyramids.solve(centre, 1, incline.contacts, incline.up);
}

// (2.28): a square of friction instead of a circle. Along its corners it holds a slope steeper by a
// factor of root two.
TEST(ForcePyramids, FrictionHasCorners) {
  for (const double azimuth : {0.0, 0.3, kPi / 4, 2.0, 3.6}) {
    const double side = std::max(std::abs(std::cos(azimuth)), std::abs(std::sin(azimuth)));
    EXPECT_TRUE(stands({0.7 / side - 0.01, azimuth, 0.7})) << azimuth;
    EXPECT_FALSE(stands({0.7 / side + 0.01, azimuth, 0.7})) << azimuth;
  }
}

TEST(ForcePyramids, WeightHasToLieOverTheContacts) {
  const Incline level(0, 0, 0);
  EXPECT_TRUE(stands(level, {0.99, 1, 0.99}));
  EXPECT_FALSE(stands(level, {1.01, 1, 0}));
}

// A result must be a solution: inside its pyramids, and in balance.
TEST(ForcePyramids, ForcesBalanceTheWeight) {
  Philox random(7, Stream::test, 0);
  int standing = 0;
  for (int round = 0; round < 300; ++round) {
    std::vector<SupportPoint> contacts;
    const uint32_t count = 1 + random.index(8);
    for (uint32_t i = 0; i < count; ++i) {
      const Vec3 position = random.direction();
      const Vec3 normal = (random.direction() + Vec3::UnitY()).normalized();
      contacts.push_back({position, normal, 0.7});
    }
    ForcePyramids pyramids;
    if (!pyramids.solve(Vec3::Zero(), 1, contacts, Vec3::UnitY())) continue;
    ++standing;
    Vec3 force = Vec3::Zero(), torque = Vec3::Zero();
    for (uint32_t i = 0; i < count; ++i) {
      const PyramidForce& of = pyramids.forces()[i];
      EXPECT_GE(of.normal, 0);
      EXPECT_LE(std::max(std::abs(of.tangent_1), std::abs(of.tangent_2)), 0.7 * of.normal + 1e-9);
      const Vec3 t1 = contacts[i].normal.unitOrthogonal(), t2 = contacts[i].normal.cross(t1);
      const Vec3 push = of.normal * contacts[i].normal + of.tangent_1 * t1 + of.tangent_2 * t2;
      force += push;
      torque += contacts[i].position.cross(push);
    }
    EXPECT_LT((force - Vec3::UnitY()).norm() + torque.norm(), 1e-5);
  }
  EXPECT_GT(standing, 30);
}

// (6.2), with the dissertation's own example of its gap: two coincident points.
TEST(NailsAsWritten, TheAreaDependsOnTheOrderOfContacts) {
  const Vec3 a(0, 0, 0), b(1, 0, 0), c(1, 0, 1), d(0, 0, 1);
  const auto area = [](const std::vector<Vec3>& points) {
    std::vector<SupportPoint> contacts;
    for (const Vec3& point : points) contacts.push_back({point, Vec3::UnitY(), 0.7});
    return area_of_triples(contacts);
  };
  EXPECT_NEAR(area({a, b, c, d}), 1, 1e-12);
  EXPECT_NEAR(area({a, b, b, d}), 0, 1e-12);
  EXPECT_NEAR(area({a, b}), 0, 1e-12);
}

// A column of cubes on the ground, bodies 1 .. count from below.
struct Column : SmallModel {
  explicit Column(int count) {
    scene.frame_rate = 60;
    Guide& guide = scene.guide.emplace();
    guide.hold = HoldKind::nail;
    wood = material(0, 0.7);
    body(plane(), wood, Vec3::Zero(), Role::fixed);
    const uint32_t cube = box(Vec3::Constant(kCube));
    for (int i = 0; i < count; ++i) body(cube, wood, kCube * Vec3(0, 0.5 + i, 0));
  }
  uint32_t wood = 0;
};

// "Delete all constraints", then one nail for each pair, at a random contact: each cycle has 20
// steps.
TEST(NailsAsWritten, EachCycleDrivesNewOnes) {
  Column column(1);
  GuidedSimulator simulator(column.scene, column.model);
  for (int frame = 0; frame < 100; ++frame) simulator.step_frame();
  EXPECT_EQ(simulator.control_steps(), 20);
  // Not always the same corner of the cube.
  std::set<std::pair<int, int>> corners;
  for (const GuideConstraints& constraints : simulator.constraints()) {
    EXPECT_LE(constraints.points.size(), 1);
    for (const Vec3& point : constraints.points) {
      EXPECT_NEAR(point.y(), 0, 1e-3);
      corners.insert({std::lround(10 * point.x()), std::lround(10 * point.z())});
    }
  }
  EXPECT_GE(corners.size(), 3);
}

// A neighbour that is no candidate keeps a candidate from being nailed at all.
TEST(NailsAsWritten, AllAroundABodyHaveToBeCandidates) {
  Column column(4);
  // The uppermost stands on an edge: two contacts.
  column.model.bodies[4].pose.orientation = Eigen::AngleAxisd(kPi / 4, Vec3::UnitZ());
  column.model.bodies[4].pose.position.y() = kCube * (3 + std::sqrt(0.5));
  GuidedSimulator simulator(column.scene, column.model);
  simulator.step_frame();
  const GuideCounts& counts = simulator.frames().back().counts;
  EXPECT_EQ(counts.passed, 3);
  EXPECT_EQ(counts.nails, 3);  // to the ground, and between the lower three
}

// (6.1), with kinetic friction: a body that needs static friction is filtered out.
TEST(NailsAsWritten, BodiesThatNeedMoreThanKineticFrictionAreFiltered) {
  for (const double kinetic_share : {0.8, 1.01}) {
    Column column(1);
    column.scene.guide->kinetic_share = kinetic_share;
    column.scene.gravity = 9.81 * Vec3(0.65, -1, 0).normalized();
    GuidedSimulator simulator(column.scene, column.model);
    simulator.step_frame();
    const GuideCounts& counts = simulator.frames().back().counts;
    EXPECT_EQ(counts.passed, kinetic_share > 1) << kinetic_share;
    EXPECT_EQ(counts.failed, 0);
  }
}

// Records the present nails. Cubes stand on the ground as given.
struct NotedNails final : ImpulseControl {
  explicit NotedNails(const Column& of) : column(of) {}

  double time_s() const override { return 0; }
  double step_s() const override { return column.scene.actual_step_s(); }
  bool is_in_world(uint32_t body) const override { return body > 0; }
  BodyMotion motion(uint32_t body) const override {
    return {.position = column.model.bodies[body].pose.position};
  }
  void put_to_sleep(uint32_t /*body*/) override { ADD_FAILURE() << "nothing is put to sleep"; }
  void wake(uint32_t /*body*/) override {}
  bool is_asleep(uint32_t /*body*/) const override { return false; }
  void set_velocity(uint32_t /*body*/, const Vec3& /*v*/, const Vec3& /*w*/) override {}
  void set_friction(uint32_t /*body*/, double /*friction*/) override {}
  void read_contacts(std::vector<BodyContact>& contacts) const override {
    contacts.clear();
    for (uint32_t body = 1; body < column.model.bodies.size(); ++body) {
      for (const Vec3& corner :
           {Vec3(1, -1, 1), Vec3(-1, -1, 1), Vec3(-1, -1, -1), Vec3(1, -1, -1)}) {
        const Vec3 point = motion(body).position + kCube / 2 * corner;
        contacts.push_back({body, body - 1, point, Vec3::UnitY(), 0});
      }
    }
  }
  ConstraintId add_nail(const Nail& nail) override {
    nails[next] = nail;
    return next++;
  }
  ConstraintId add_glue(const GlueSpot& /*spot*/) override { return next++; }
  void remove_constraint(ConstraintId constraint) override { nails.erase(constraint); }
  bool holds(ConstraintId constraint) const override { return nails.contains(constraint); }
  void mark(uint32_t /*body*/, uint8_t /*mask*/, uint8_t /*flags*/) override {}

  const Column& column;
  std::map<ConstraintId, Nail> nails;
  ConstraintId next = 0;
};

// kappa = 5 m; after the first step and then after every 20th.
TEST(NailsAsWritten, EachPairHasOneThatBreaksAtFiveTimesTheMass) {
  Column column(3);
  for (uint32_t body = 1; body <= 3; ++body) column.model.bodies[body].mass_kg = body;
  NotedNails control(column);
  NailDirector director(column.scene, column.model);
  for (int step = 0; step <= 50; ++step) {
    director.direct(control);
    ASSERT_EQ(control.nails.size(), step == 0 ? 0 : 3) << step;
    ASSERT_EQ(control.next, step == 0 ? 0 : 3 * (1 + (step - 1) / 20)) << step;
  }
  std::vector<double> strengths;
  for (const auto& nail : control.nails) strengths.push_back(nail.second.breaking_impulse_ns);
  EXPECT_EQ(strengths, (std::vector<double>{5, 5, 10}));  // of the pair's first candidate
}

}  // namespace
}  // namespace pilesim
