// Near bodies on a ground that prefers to be statistical, with signatures.

#include <gtest/gtest.h>

#include "support/statistical_scene.h"

namespace pilesim {
namespace {

class MixedGround : public test::StatisticalScene {
 protected:
  MixedGround() {
    scene_.step_s = 1.0 / 120;
    scene_.frame_rate = 60;
    scene_.simulator.mode = SimulatorMode::mixed;
    scene_.simulator.solver_iterations = 20;
    add_ground();
  }

  Body& add_exact(const std::string& shape, const Vec3& position, const Quat& turn) {
    Body& body = add_body(shape, position);
    body.role = Role::fixed;
    body.preference = Preference::must_impulse;
    body.pose.orientation = turn;
    return body;
  }
  bool is_near(uint32_t body) const { return (states().flags[body] & kImpulse) != 0; }
};

Quat about_z(double angle) { return Quat(Eigen::AngleAxisd(angle, Vec3::UnitZ())); }

TEST_F(MixedGround, ABodyHalfOnAMustImpulseOneAndHalfOnTheGroundRests) {
  add_shape("plate", box_mesh({0.6, 0.04, 0.3}));
  scene_.shapes["foot"] = BoxShape{{0.4, 0.03, 0.4}};
  add_exact("foot", {0, 0.015, 0}, Quat::Identity());
  add_body("plate", {0.35, 0.06, 0});
  start();
  EXPECT_EQ(run(120).bodies_awake, 0U);
  EXPECT_TRUE(is_near(2));
  const Vec3 along = states().orientation[2] * Vec3::UnitX();
  EXPECT_LT(along.y(), -0.05);  // from the foot's edge down to the ground
}

TEST_F(MixedGround, ABodyOnExactContactsKeepsItsPose) {
  // A cube on its edge in a groove at 45 degrees. The ground, which a rule leaves to spheres, would
  // turn it onto a face.
  constexpr double kHalf = 0.1;
  add_shape("cube", box_mesh({2 * kHalf, 2 * kHalf, 2 * kHalf}));
  scene_.shapes["side"] = BoxShape{{2 * kHalf, 2 * kHalf, 1}};
  const double edge = std::sqrt(2.0) * kHalf;
  add_exact("side", {edge, 0, 0}, about_z(kPi / 4));
  add_exact("side", {-edge, 0, 0}, about_z(kPi / 4));
  add_body("cube", {0, edge, 0}).pose.orientation = about_z(kPi / 4);
  scene_.simulator.detail.pairs = {{"cube3", "ground", PairMethod::statistical}};
  start();
  EXPECT_EQ(run(90).bodies_awake, 0U);
  EXPECT_TRUE(is_near(3));
  EXPECT_LT(states().orientation[3].angularDistance(about_z(kPi / 4)), 0.01);
}

TEST_F(MixedGround, ABodyOnAnEdgeTipsOverIt) {
  // A plate, too thick to be solved there, stands in a slot, and another one lies on its edge: the
  // rolling resistance of level plates does not hold it.
  add_shape("plate", box_mesh({0.6, 0.18, 0.6}));
  change_packing("plate", [](Packing& packing) { packing.rolling = 0.5; });
  scene_.shapes["side"] = BoxShape{{0.2, 0.3, 1}};
  add_exact("side", {0.192, 0.15, 0}, Quat::Identity());
  add_exact("side", {-0.192, 0.15, 0}, Quat::Identity());
  add_body("plate", {0, 0.3, 0}).pose.orientation = about_z(kPi / 2);
  add_body("plate", {0.18, 0.8, 0});
  start();
  EXPECT_EQ(run(180).bodies_awake, 0U);
  EXPECT_GT(std::abs((states().orientation[3] * Vec3::UnitX()).y()), 0.9);
  EXPECT_LT(states().position[4].y(), 0.45);
}

TEST_F(MixedGround, WhatFarBodiesCannotPushIsSolvedAsInTheImpulseMode) {
  // Small cubes, the upper ones far, need more substeps than the crate.
  add_shape("cube", box_mesh({0.04, 0.04, 0.04}));
  scene_.shapes["slab"] = BoxShape{{0.5, 0.1, 0.5}};
  scene_.shapes["crate"] = BoxShape{{0.4, 0.5, 0.6}};
  add_exact("slab", {0, 0.05, 0}, Quat::Identity());
  for (int i = 0; i < 4; ++i) add_body("cube", {0, 0.12 + 0.04 * i, 0});
  Body& crate = add_body("crate", {5, 0.6, 0});
  crate.preference = Preference::must_impulse;
  crate.pose.orientation = about_z(0.4);
  scene_.simulator.sleeping = false;
  std::vector<Vec3> places;
  for (const SimulatorMode mode : {SimulatorMode::mixed, SimulatorMode::impulse}) {
    scene_.simulator.mode = mode;
    start();
    for (int frame = 0; frame < 60; ++frame) {
      run(1);
      if (mode == SimulatorMode::mixed) {
        ASSERT_TRUE(is_near(2) && !is_near(5));
        places.push_back(states().position[6]);
      } else {
        ASSERT_EQ(states().position[6], places[static_cast<size_t>(frame)]) << frame;
      }
    }
  }
}

constexpr double kThick = 0.06;

// A square ring about the y axis.
TriangleMesh ring_mesh(double outer, double inner) {
  TriangleMesh mesh;
  for (const double half : {outer / 2, inner / 2}) {
    for (const double y : {-kThick / 2, kThick / 2}) {
      for (const auto& [x, z] : {std::pair{1, 1}, {1, -1}, {-1, -1}, {-1, 1}}) {
        mesh.vertices.emplace_back(x * half, y, z * half);
      }
    }
  }
  // Vertices of a corner: outer below, outer above, inner below, inner above.
  const auto add = [&](uint32_t a, uint32_t b, uint32_t c, uint32_t d) {
    mesh.triangles.push_back({a, b, c});
    mesh.triangles.push_back({a, c, d});
  };
  for (uint32_t i = 0; i < 4; ++i) {
    const uint32_t j = (i + 1) % 4;
    add(i, j, 4 + j, 4 + i);
    add(8 + j, 8 + i, 12 + i, 12 + j);
    add(4 + i, 4 + j, 12 + j, 12 + i);
    add(j, i, 8 + i, 8 + j);
  }
  return mesh;
}

class MixedRings : public MixedGround {
 protected:
  MixedRings() {
    add_shape("ring", ring_mesh(0.5, 0.3));
    std::get<MeshShape>(scene_.shapes["ring"]).collision = CollisionKind::decomposition;
    scene_.shapes["post"] = BoxShape{{0.15, 2, 0.15}};
    add_exact("post", {0, 1, 0}, Quat::Identity());
  }
};

TEST_F(MixedRings, LieOnEachOtherAroundAPost) {
  for (int i = 0; i < 3; ++i) add_body("ring", {0.02 * i, 2.1 + 0.3 * i, 0});
  start();
  EXPECT_EQ(run(180).bodies_awake, 0U);
  for (int i = 0; i < 3; ++i) {
    EXPECT_TRUE(is_near(2 + i));
    EXPECT_NEAR(states().position[2 + i].y(), (i + 0.5) * kThick, 0.005) << i;
  }
}

TEST_F(MixedRings, ARingOnTheEdgeOfAHangingOneTipsOver) {
  // Ellipsoids with such rolling resistance would stay.
  change_packing("ring", [](Packing& packing) { packing.rolling = 8; });
  scene_.shapes["hook"] = BoxShape{{0.3, 0.05, 0.1}};
  add_exact("hook", {2, 1, 0}, Quat::Identity());
  add_body("ring", {2, 0.875, 0}).pose.orientation = about_z(kPi / 2);
  add_body("ring", {2.04, 1.2, 0});
  start();
  run(180);
  EXPECT_NEAR(states().position[3].y(), 0.875, 0.05);
  EXPECT_LT(states().position[4].y(), 1);
}

}  // namespace
}  // namespace pilesim
