// Contacts of spheres: impulses carried over from the previous step, and contacts with sleepers.

#include <gtest/gtest.h>

#include <cmath>

#include "geometry/obj_writer.h"
#include "support/statistical_scene.h"

namespace pilesim {
namespace {

class ParticleContacts : public test::StatisticalScene {
 protected:
  ParticleContacts() { scene_.simulator.mode = SimulatorMode::particle; }
  void add_ball(const std::string& name, double radius) {
    scene_.shapes[name] = SphereShape{radius};
  }
};

// One carries more than the other. With one sweep per step the solution relies on the previous
// step.
TEST_F(ParticleContacts, EachSideOfAGrooveGoesOnWithItsOwnPush) {
  const double gentle = radians(10), steep = radians(45);
  // A valley along z; solid below.
  const double reach = 3;
  TriangleMesh groove;
  const Vec3 left(-reach, reach * std::tan(gentle), 0), right(reach, reach * std::tan(steep), 0);
  const std::vector<Vec3> outline = {Vec3::Zero(), right, {reach, -1, 0}, {-reach, -1, 0}, left};
  for (const double z : {-2.0, 2.0}) {
    for (const Vec3& corner : outline) groove.vertices.push_back(corner + Vec3(0, 0, z));
  }
  for (uint32_t i = 0; i < 5; ++i) {
    const uint32_t next = (i + 1) % 5;
    groove.triangles.push_back({i, i + 5, next + 5});
    groove.triangles.push_back({i, next + 5, next});
  }
  for (uint32_t i = 2; i < 4; ++i) {
    groove.triangles.push_back({0, i - 1, i});
    groove.triangles.push_back({5, i + 5, i + 4});
  }
  groove.triangles.push_back({0, 3, 4});
  groove.triangles.push_back({5, 9, 8});
  write_obj(groove, directory_ / "groove.obj");
  MeshShape shape{.file = directory_ / "groove.obj"};
  scene_.shapes["groove"] = shape;
  scene_.bodies.push_back(
      {.name = "groove", .shape = "groove", .material = "stuff", .role = Role::fixed});
  scene_.materials["stuff"].friction = 0;
  scene_.materials["stuff"].restitution = 0;
  scene_.simulator.sleeping = false;
  scene_.simulator.solver_iterations = 1;
  add_ball("ball", 0.5);
  // Touches both.
  const double angle = (steep - gentle) / 2;
  const double far = 0.5 / std::cos((steep + gentle) / 2);
  add_body("ball", far * Vec3(-std::sin(angle), std::cos(angle), 0));
  start();
  run(10);
  EXPECT_LT(states().linear_velocity[1].norm(), 3e-4);
}

// A sleeper is found at the first touch, however little the bodies move in a step.
TEST_F(ParticleContacts, SleepersCarryBodiesThatComeToRestOnThem) {
  scene_.step_s = 1.0 / 240;
  scene_.frame_rate = 240;
  add_ground();
  add_ball("large", 1.5);
  add_ball("small", 1);
  Emitter& sleepers = add_grid("large", {10, 1, 10}, {4, 4, 4}, {0, 1.5, 0});
  sleepers.position_jitter_m = 0;
  sleepers.asleep = true;
  Emitter& late = add_grid("small", {1, 1, 1}, {1, 1, 1}, {2, 4.008, 2});
  late.position_jitter_m = 0;
  late.start_s = 0.5;
  start();
  run(360);
  EXPECT_GT(simulator_->statistics().bodies_awake, 0);
  EXPECT_LT(states().position[101].y(), 4);
  EXPECT_GT(states().position[101].y(), 4 - 0.007) << "of the smaller radius 0.005 are usual";
}

}  // namespace
}  // namespace pilesim
