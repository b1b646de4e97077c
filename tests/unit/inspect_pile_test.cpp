// Piles with known faults.
#include "core/rotation.h"
#include "inspect/pile_inspection.h"

#include <gtest/gtest.h>

#include <cmath>

namespace pilesim {
namespace {

constexpr double kEdge = 0.2;
const double kDiameter = kEdge * std::sqrt(3.0);
const Vec3 kGravity(0, -9.81, 0);

// Boxes on a plane, as exact primitives, at rest.
class PileInspection : public testing::Test {
 protected:
  PileInspection() {
    model.materials.emplace_back();
    model.shapes.push_back({.name = "ground", .is_plane = true});
    ModelShape& box = model.shapes.emplace_back();
    box.name = "box";
    box.mass = box_mass_properties(Vec3::Constant(kEdge));
    box.bounding_radius = kDiameter / 2;
    box.smallest_extent = kEdge;
    box.pieces.push_back({.kind = CollisionPiece::Kind::box, .size = Vec3::Constant(kEdge)});
    add(0, Role::fixed, Vec3::Zero());
  }
  void add(uint32_t shape, Role role, const Vec3& position, uint8_t flags = kAsleep) {
    ModelBody body{.linear_velocity = Vec3::Zero(), .angular_velocity = Vec3::Zero()};
    body.shape = shape;
    body.role = role;
    model.bodies.push_back(body);
    states.position.push_back(position);
    states.orientation.push_back(Quat::Identity());
    states.linear_velocity.push_back(Vec3::Zero());
    states.angular_velocity.push_back(Vec3::Zero());
    states.flags.push_back(static_cast<uint8_t>(flags | kPresent));
  }
  void add_box(const Vec3& position, uint8_t flags = kAsleep) {
    add(1, Role::dynamic, position, flags);
  }
  PileQuality inspect(const Vec3& gravity = kGravity) const {
    return inspect_pile(model, gravity, states);
  }

  Model model;
  BodyStates states;
};

// A pile that drifts for ever, awake and far slower than a moving one, has not settled.
TEST_F(PileInspection, CreepingBodiesAreNotAtRest) {
  add_box(Vec3(0, kEdge / 2, 0), 0);
  add_box(Vec3(1, kEdge / 2, 0), 0);
  add_box(Vec3(2, kEdge / 2, 0), kAsleep);
  add_box(Vec3(3, kEdge / 2, 0), 0);  // absent before
  EarlierPlaces earlier{.ago_s = 0.5, .position = states.position, .flags = states.flags};
  earlier.flags[4] = 0;
  const double unit = std::sqrt(9.81 * kDiameter / 2);
  for (uint32_t i = 1; i <= 4; ++i) earlier.position[i].z() += 0.9 * kCreepingSpeed * unit * 0.5;
  EXPECT_EQ(count_unsettled(model, kGravity, states, earlier), 0);
  for (uint32_t i = 2; i <= 4; ++i) earlier.position[i].z() += 0.2 * kCreepingSpeed * unit * 0.5;
  EXPECT_EQ(count_unsettled(model, kGravity, states, earlier), 1);
  EXPECT_EQ(inspect_pile(model, kGravity, states, earlier).unsettled, 1);
  EXPECT_EQ(inspect_pile(model, kGravity, states).unsettled, 0);
  EXPECT_EQ(count_unsettled(model, Vec3::Zero(), states, earlier), 0);
}

TEST_F(PileInspection, HowDeepABodyIsInTheOneItIsDeepestIn) {
  add_box(Vec3(0, 0.49 * kEdge, 0));  // in the ground
  add_box(Vec3(0, 1.46 * kEdge, 0));  // in the one below
  add_box(Vec3(0, 2.26 * kEdge, 0));  // in the one below, deeper than that one is in its own
  add_box(Vec3(5, kEdge, 0));         // alone
  add_box(Vec3(5.9 * kEdge, 5 * kEdge, 0), kHeld);  // also inside a fixed one
  add_box(Vec3(5.1 * kEdge, 5 * kEdge, 0), kAsleep);
  add(1, Role::fixed, Vec3(5.1 * kEdge, 5.3 * kEdge, 0));
  add_box(Vec3(5, kEdge, 0));
  states.flags.back() = 0;  // not there
  const std::vector<double> expected = {0.01, 0.03, 0.2, 0.2, 0, 0.2, 0.7, 0.7, 0};
  const std::vector<double> depths = overlap_depths(model, states);
  ASSERT_EQ(depths.size(), expected.size());
  for (size_t i = 0; i < depths.size(); ++i) EXPECT_NEAR(depths[i] / kEdge, expected[i], 1e-9) << i;
}

TEST_F(PileInspection, ASoundStack) {
  for (int i = 0; i < 5; ++i) add_box(Vec3(0, kEdge * (i + 0.5), 0));
  const PileQuality quality = inspect();
  EXPECT_EQ(quality.bodies, 5);
  EXPECT_EQ(quality.unsettled + quality.escaped + quality.floating, 0);
  EXPECT_NEAR(quality.deepest_penetration_m, 0, 1e-12);
  EXPECT_NEAR(quality.largest_gap_m, 0, 1e-12);
  EXPECT_NEAR(quality.body_diameter_m, kDiameter, 1e-12);
}

TEST_F(PileInspection, MeasuresPenetrationOfBoxesAndPlane) {
  add_box(Vec3(0, kEdge / 2 - 0.003, 0));
  add_box(Vec3(0, 1.5 * kEdge - 0.008, 0));  // penetrates the lower one by 5 mm
  const PileQuality quality = inspect();
  EXPECT_EQ(quality.overlapping_pairs, 2);
  EXPECT_NEAR(quality.deepest_penetration_m, 0.005, 1e-12);
  EXPECT_NEAR(quality.mean_penetration_m, 0.004, 1e-12);
}

TEST_F(PileInspection, FindsWhatFloats) {
  add_box(Vec3(0, kEdge / 2, 0));
  add_box(Vec3(0, 1.5 * kEdge + 0.02, 0));  // a gap of 0.06 D
  add_box(Vec3(3, 1, 0));                   // two that lie on each other but on nothing else
  add_box(Vec3(3, 1 + kEdge, 0));
  const PileQuality quality = inspect();
  EXPECT_EQ(quality.floating, 3);
  EXPECT_NEAR(quality.largest_gap_m, 0.02, 1e-12);
  EXPECT_EQ(inspect(Vec3::Zero()).floating, 0);
}

TEST_F(PileInspection, MovingBodiesNeitherFloatNorRest) {
  add_box(Vec3(0, 2, 0), 0);
  states.linear_velocity.back() = Vec3(0, -1, 0);
  add_box(Vec3(2, kEdge / 2, 0), 0);  // awake and at rest
  add_box(Vec3(4, kEdge / 2, 0), 0);
  states.angular_velocity.back() = Vec3(0, 3, 0);
  const PileQuality quality = inspect();
  EXPECT_EQ(quality.unsettled, 2);
  EXPECT_EQ(quality.floating, 0);
  EXPECT_EQ(inspect(Vec3::Zero()).unsettled, 0);
}

TEST_F(PileInspection, ANeedleThatTurnsAboutItsAxisRests) {
  const Vec3 size(1, 0.005, 0.005);
  model.shapes[1].mass = box_mass_properties(size);
  model.shapes[1].bounding_radius = size.norm() / 2;
  model.shapes[1].pieces[0].size = size;
  const Quat upright = rotation_between(Vec3::UnitX(), Vec3::UnitY());
  for (const double x : {0.0, 3.0}) {
    add_box(Vec3(x, 0.5, 0), 0);
    states.orientation.back() = upright;
  }
  states.angular_velocity[1] = Vec3(0, 2, 0);  // about its axis
  EXPECT_EQ(inspect().unsettled, 0);
  states.angular_velocity[2] = Vec3(2, 0, 0);
  EXPECT_EQ(inspect().unsettled, 1);
}

TEST_F(PileInspection, FindsWhatEscaped) {
  add_box(Vec3(0, -1, 0));
  EXPECT_EQ(inspect().escaped, 1);
  // Half inside is deep, but not through.
  add_box(Vec3(2, 0, 0));
  EXPECT_EQ(inspect().escaped, 1);
  // Without a plane: below all fixed bodies.
  model.shapes[0] = model.shapes[1];
  states.position[1] = Vec3(0.5, -1, 0);
  EXPECT_EQ(inspect().escaped, 1);
}

TEST_F(PileInspection, LeavesOutWhatIsNotThere) {
  add_box(Vec3(0, -1, 0));
  states.flags.back() = 0;
  const PileQuality quality = inspect();
  EXPECT_EQ(quality.bodies, 0);
  EXPECT_EQ(quality.escaped, 0);
}

TEST_F(PileInspection, MeasuresAgainstAMesh) {
  model.shapes.push_back({.name = "table"});
  ModelShape& table = model.shapes.back();
  table.mesh.vertices = {{-1, 0.5, -1}, {1, 0.5, -1}, {1, 0.5, 1}, {-1, 0.5, 1}};
  table.mesh.triangles = {{0, 2, 1}, {0, 3, 2}};
  table.collides_as_mesh = true;
  table.smallest_extent = 0.1;
  add(2, Role::fixed, Vec3::Zero());
  add_box(Vec3(0.3, 0.5 + kEdge / 2 - 0.004, 0.1));
  const PileQuality quality = inspect();
  EXPECT_NEAR(quality.deepest_penetration_m, 0.004, 1e-12);
  EXPECT_EQ(quality.floating, 0);
}

// A box, a ball, an upright drum and a hull side by side on one long box, each with its own
// penetration depth.
TEST_F(PileInspection, KnowsEveryKindOfPieceFarFromTheOrigin) {
  using Kind = CollisionPiece::Kind;
  const double r = kEdge / 2;
  CollisionPiece hull{.kind = Kind::hull};
  hull.hull.vertices = {{-r, -r, -r}, {r, -r, -r}, {0, -r, r}, {0, r, 0}};
  const std::vector<CollisionPiece> pieces = {
      {.kind = Kind::box, .size = Vec3::Constant(kEdge)},
      {.kind = Kind::sphere, .size = Vec3::Constant(r)},
      {.kind = Kind::round, .round = RoundSector::cylinder(r, kEdge)},
      hull,
      {.kind = Kind::box, .size = Vec3(10, kEdge, 10)}};
  for (const CollisionPiece& piece : pieces) {
    ModelShape shape = model.shapes[1];
    shape.pieces = {piece};
    model.shapes.push_back(shape);
  }
  const Vec3 origin(5e5, 1e6, -5.2e6);
  states.position[0] = origin - Vec3(0, 100, 0);
  add(6, Role::fixed, origin - Vec3(0, r, 0));
  for (uint32_t shape = 2; shape < 6; ++shape) {
    for (size_t i = states.size(); i-- > 2;) states.flags[i] = 0;
    const double depth = 0.001 * shape;
    add(shape, Role::dynamic, origin + Vec3(shape, r - depth, 0));
    const PileQuality quality = inspect();
    EXPECT_EQ(quality.overlapping_pairs, 1) << shape;
    EXPECT_NEAR(quality.deepest_penetration_m, depth, 1e-9) << shape;
    EXPECT_EQ(quality.floating, 0) << shape;
  }
}

TEST_F(PileInspection, AgreesWithEveryPairTakenAlone) {
  // A random heap: the deepest overlap and the number of pairs, from all pairs of boxes.
  for (int i = 0; i < 40; ++i) {
    const int layer = i / 16, row = i / 4 % 4;
    add_box(Vec3(0.13 * (i % 4), 0.6 + 0.15 * layer, 0.14 * row));
  }
  uint64_t pairs = 0;
  double deepest = 0;
  for (size_t i = 1; i < states.size(); ++i) {
    for (size_t j = i + 1; j < states.size(); ++j) {
      const Vec3 overlap =
          (Vec3::Constant(kEdge) - (states.position[i] - states.position[j]).cwiseAbs());
      if (overlap.minCoeff() <= 1e-9) continue;
      ++pairs;
      deepest = std::max(deepest, overlap.minCoeff());
    }
  }
  const PileQuality quality = inspect();
  EXPECT_EQ(quality.overlapping_pairs, pairs);
  EXPECT_NEAR(quality.deepest_penetration_m, deepest, 1e-12);
}

}  // namespace
}  // namespace pilesim
