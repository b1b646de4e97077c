// Cones, tubes and tori roll as closed forms say, on planes, boxes and triangles.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "core/philox.h"
#include "inspect/pile_inspection.h"
#include "scene/scene_loader.h"
#include "simulate/modes/make_simulator.h"
#include "support/small_model.h"
#include "support/small_simulation.h"

namespace pilesim {
namespace {

enum class Ground { plane, box, triangles };

// Shape 0 as a scene has it, shape 1 a ground whose top is at y = 0; gravity tilted by `slope`
// towards x. No body yet but the ground.
SmallModel scene_of(const std::string& shape, Ground ground, double slope) {
  const std::string text = R"({"version": 1, "materials": {"m": {}}, "shapes": {"s": {)" + shape +
                           R"(}}, "bodies": [{"shape": "s", "material": "m"}]})";
  SmallModel m;
  m.model.shapes = build_model(parse_scene(text, "scene.json").scene).shapes;
  m.scene.frame_rate = 60;
  m.scene.gravity = test::kGravity * Vec3(std::sin(slope), -std::cos(slope), 0);
  const uint32_t material = m.material(0, 0.9);
  const uint32_t shape_of_ground = ground == Ground::plane ? m.plane() : m.box({40, 1, 40});
  if (ground == Ground::triangles) {
    m.model.shapes[shape_of_ground].pieces.clear();
    m.model.shapes[shape_of_ground].collides_as_mesh = true;
  }
  const Vec3 top(0, ground == Ground::plane ? 0 : -0.5, 0);
  m.body(shape_of_ground, material, top, Role::fixed);
  return m;
}

std::string name_of(Ground ground) {
  return ground == Ground::plane ? "plane" : ground == Ground::box ? "box" : "triangles";
}

// Standing on its round side, it rolls down a slope: x = g sin(slope) t^2 / 2 / (1 + I / m R^2).
void expect_rolls(const std::string& shape, double radius, int frames) {
  constexpr double kSlope = radians(1.5);
  for (const Ground ground : {Ground::plane, Ground::box, Ground::triangles}) {
    SCOPED_TRACE(shape + " on " + name_of(ground));
    SmallModel m = scene_of(shape, ground, kSlope);
    ModelBody& body = m.body(0, 0, {0, radius, 0});
    body.pose.orientation = Quat(Eigen::AngleAxisd(kPi / 2, Vec3::UnitX()));
    const MassProperties& mass = m.model.shapes[0].mass;
    const double inertia = mass.inertia_m5(1, 1) / (mass.volume_m3 * radius * radius);
    const auto simulator = make_simulator(m.scene, m.model);
    run(*simulator, frames);
    const double t = frames / 60.0;
    const double way = test::kGravity * std::sin(kSlope) * t * t / 2 / (1 + inertia);
    const BodyStates& states = simulator->states();
    EXPECT_NEAR(states.position[1].x(), way, 0.01 * way);
    EXPECT_NEAR(states.position[1].y(), radius, 1e-4 * radius);
    EXPECT_NEAR(states.position[1].z(), 0, 0.01 * way);
  }
}

TEST(RoundShapes, TubesRollDownAGentleSlope) {
  expect_rolls(R"("type": "tube", "radius": 0.2, "height": 0.5, "thickness": 0.02)", 0.2, 120);
  expect_rolls(R"("type": "tube", "radius": 0.02, "height": 0.01, "thickness": 0.008)", 0.02, 120);
}

// It stands on a point and would fall over in time.
TEST(RoundShapes, ToriRollDownAGentleSlope) {
  expect_rolls(R"("type": "torus", "radius": 0.3, "tube_radius": 0.1)", 0.4, 60);
}

// A cone that lies on its side swings about its tip on a slope as a pendulum does:
// w^2 = 5 g sin(slope) cos(a) / (h (1 + 5 cos^2 a)), a its half angle, h its height (its energy of
// motion after Landau and Lifshitz, Mechanics, section 32).
TEST(RoundShapes, AConeSwingsAboutItsTip) {
  constexpr double kHeight = 0.4, kSlope = radians(10), kStart = 0.1;  // m, rad, rad
  const double a = std::atan2(0.15, kHeight);
  const double w = std::sqrt(5 * test::kGravity * std::sin(kSlope) * std::cos(a) /
                             (kHeight * (1 + 5 * std::cos(a) * std::cos(a))));
  for (const Ground ground : {Ground::plane, Ground::box, Ground::triangles}) {
    SCOPED_TRACE(name_of(ground));
    SmallModel m = scene_of(R"("type": "cone", "radius": 0.15, "height": 0.4)", ground, kSlope);
    const Vec3 axis(std::cos(a) * std::cos(kStart), std::sin(a), std::cos(a) * std::sin(kStart));
    ModelBody& body = m.body(0, 0, 0.75 * kHeight * axis);  // from the tip down the slope
    body.pose.orientation = Quat::FromTwoVectors(Vec3::UnitY(), -axis);
    const auto simulator = make_simulator(m.scene, m.model);
    const auto angle = [&] {
      const Vec3 tip = simulator->states().position[1] +
                       simulator->states().orientation[1] * Vec3(0, 0.75 * kHeight, 0);
      const Vec3 along = simulator->states().position[1] - tip;
      return std::atan2(along.z(), along.x());
    };
    // From one side to the other, where it turns round.
    double most = 0, when_s = 0;
    const int frames = static_cast<int>(60 * 1.5 * kPi / w);
    for (int i = 1; i <= frames; ++i) {
      simulator->step_frame();
      if (angle() < most) {
        most = angle();
        when_s = i / 60.0;
      }
    }
    EXPECT_NEAR(when_s, kPi / w, 0.03 * kPi / w);
    EXPECT_NEAR(most, -kStart, 0.1 * kStart);
  }
}

// Standing, lying and upside down where it can: at rest at once, nowhere deep.
TEST(RoundShapes, TheyRestOnTheirFlatFaces) {
  struct Case {
    std::string shape;
    double height;  // of its middle above the ground
    Quat turn = Quat::Identity();
  };
  const Quat over(Eigen::AngleAxisd(kPi, Vec3::UnitX()));
  for (const Case& each :
       {Case{R"("type": "cone", "radius": 0.2, "height": 0.4)", 0.1},
        Case{R"("type": "cone", "radius": 0.2, "height": 0.3, "top_radius": 0.2)", 0.15},
        Case{R"("type": "tube", "radius": 0.2, "height": 0.3, "thickness": 0.05)", 0.15},
        Case{R"("type": "tube", "radius": 0.2, "height": 0.3, "thickness": 0.05)", 0.15, over},
        Case{R"("type": "torus", "radius": 0.3, "tube_radius": 0.1)", 0.1}}) {
    for (const Ground ground : {Ground::plane, Ground::box, Ground::triangles}) {
      SCOPED_TRACE(each.shape + " on " + name_of(ground));
      SmallModel m = scene_of(each.shape, ground, 0);
      m.body(0, 0, {0.03, each.height, 0.01}).pose.orientation = each.turn;
      const auto simulator = make_simulator(m.scene, m.model);
      const FrameStatistics last = run(*simulator, 120);
      EXPECT_EQ(last.bodies_awake, 0);
      EXPECT_NEAR(simulator->states().position[1].y(), each.height, 2e-4);
      EXPECT_GT(std::abs((simulator->states().orientation[1] * Vec3::UnitY()).y()), 1 - 1e-6);
    }
  }
}

// Rims that cross part whatever the pieces between them want.
TEST(RoundShapes, RingsThatPenetrateSeparate) {
  Philox random(1, Stream::test, 0);
  for (const char* shape : {R"("type": "tube", "radius": 0.2, "height": 0.5, "thickness": 0.03)",
                            R"("type": "torus", "radius": 0.3, "tube_radius": 0.1)",
                            R"("type": "cone", "radius": 0.2, "height": 0.4)"}) {
    for (int i = 0; i < 20; ++i) {
      SCOPED_TRACE(std::string(shape) + ", " + std::to_string(i));
      SmallModel m = scene_of(shape, Ground::plane, 0);
      m.model.bodies.clear();
      m.scene.gravity = Vec3::Zero();
      const auto turn = [&] {
        Quat random_turn;
        for (double& part : random_turn.coeffs()) part = random.uniform() - 0.5;
        return random_turn.normalized();
      };
      const Vec3 direction = turn() * Vec3::UnitX();
      m.body(0, 0, Vec3::Zero()).pose.orientation = turn();
      m.body(0, 0, Vec3::Zero()).pose.orientation = turn();
      const auto depth_m = [&](const BodyStates& states) {
        return inspect_pile(m.model, m.scene.gravity, states).deepest_penetration_m;
      };
      // From far away until they penetrate by 5 mm.
      for (double apart = 1; apart > 0; apart -= 0.001) {
        m.model.bodies[1].pose.position = apart * direction;
        if (depth_m(m.states()) > 0.005) break;
      }
      ASSERT_GT(depth_m(m.states()), 0.005);
      const auto simulator = make_simulator(m.scene, m.model);
      run(*simulator, 60);
      EXPECT_LT(depth_m(simulator->states()), 2e-4);
      for (const Vec3& velocity : simulator->states().linear_velocity) {
        EXPECT_LT(velocity.norm(), 0.2);
      }
    }
  }
}

}  // namespace
}  // namespace pilesim
