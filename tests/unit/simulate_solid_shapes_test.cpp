// Cones, capsules, rings, wedges and letters on the ground, at the heights that their forms say.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "model/model_shapes.h"
#include "simulate/modes/make_simulator.h"
#include "simulate/simulator.h"
#include "support/small_model.h"
#include "support/small_simulation.h"

namespace pilesim {
namespace {

struct OnPlane : SmallModel {
  OnPlane() { body(plane(), material(0, 0.5), Vec3::Zero(), Role::fixed); }

  uint32_t shape(const Shape& source) {
    const std::string name = std::to_string(model.shapes.size());
    scene.shapes[name] = source;
    model.shapes.push_back(build_shape(scene, name, meshes));
    return static_cast<uint32_t>(model.shapes.size() - 1);
  }

  MeshLibrary meshes;
};

const Quat kLying(Eigen::AngleAxisd(kPi / 2, Vec3::UnitX()));

// The centre of mass comes to rest at `height`, from a little above it.
void expect_rest(const Shape& source, double height, const Quat& turn = Quat::Identity(),
                 double tolerance = 2e-5) {
  OnPlane m;
  m.body(m.shape(source), 0, {0, height + 0.005, 0}).pose.orientation = turn;
  const auto simulator = make_simulator(m.scene, m.model);
  const FrameStatistics end = run(*simulator, 180);
  EXPECT_NEAR(simulator->states().position[1].y(), height, tolerance);
  EXPECT_EQ(end.bodies_awake, 0);
}

TEST(SolidShapes, RestAtTheirHeights) {
  expect_rest(ConeShape{.radius = 0.05, .height = 0.1}, 0.1 / 4);
  expect_rest(CapsuleShape{.radius = 0.03, .height = 0.12}, 0.03, kLying);
  expect_rest(TorusShape{.radius = 0.06, .tube_radius = 0.02}, 0.02);
  expect_rest(TubeShape{.radius = 0.05, .height = 0.1, .thickness = 0.01}, 0.05);
  expect_rest(WedgeShape{.size = {0.1, 0.06, 0.08}}, 0.06 / 3);
  expect_rest(TextShape{.text = "L", .height = 0.1, .depth = 0.03}, 0.015, kLying);
}

// On what is round as a polygon: within its error.
TEST(SolidShapes, RestOnTheirRoundSides) {
  expect_rest(TubeShape{.radius = 0.05, .height = 0.1, .thickness = 0.01}, 0.05, kLying, 0.0002);
  expect_rest(TorusShape{.radius = 0.06, .tube_radius = 0.02}, 0.08, kLying, 0.0008);
}

TEST(SolidShapes, ABallFallsThroughARing) {
  for (const Shape& ring : {Shape(TorusShape{.radius = 0.06, .tube_radius = 0.02}),
                            Shape(TubeShape{.radius = 0.05, .height = 0.1, .thickness = 0.01})}) {
    OnPlane m;
    m.body(m.shape(ring), 0, {0, 0.3, 0}, Role::fixed);
    m.body(m.sphere(0.036), 0, {0, 0.5, 0});
    const auto simulator = make_simulator(m.scene, m.model);
    run(*simulator, 120);
    EXPECT_NEAR(simulator->states().position[2].y(), 0.036, 1e-4);
  }
}

TEST(SolidShapes, ARingStaysOnAPole) {
  OnPlane m;
  m.body(m.cylinder(0.03, 0.4), 0, {0, 0.2, 0}, Role::fixed);
  m.body(m.shape(TorusShape{.radius = 0.06, .tube_radius = 0.02}), 0, {0, 0.5, 0});
  const auto simulator = make_simulator(m.scene, m.model);
  run(*simulator, 180);
  EXPECT_NEAR(simulator->states().position[2].y(), 0.02, 1e-3);
  EXPECT_LT(std::hypot(simulator->states().position[2].x(), simulator->states().position[2].z()),
            0.011);
}

}  // namespace
}  // namespace pilesim
