// Structures of blocks in the mixed mode: face contacts last until blocks separate.

#include <gtest/gtest.h>

#include "support/statistical_scene.h"

namespace pilesim {
namespace {

class Blocks : public test::StatisticalScene {
 protected:
  static constexpr double kSide = 0.2;

  Blocks() {
    scene_.simulator.mode = SimulatorMode::mixed;
    scene_.simulator.solver_iterations = 20;
    scene_.step_s = 1.0 / 240;
    add_shape("cube", box_mesh({kSide, kSide, kSide}));
    add_ground();
  }
  void add_column(int count) {
    Emitter& column = add_grid("cube", {1, count, 1}, {1, kSide, 1}, {0, count * kSide / 2, 0});
    column.asleep = true;
    column.position_jitter_m = 0;
    column.orientation = Quat::Identity();
  }
  void push(const std::string& body, const Vec3& impulse_ns) {
    scene_.events.push_back({.time_s = 0.01, .action = ImpulseEvent{{body}, impulse_ns, {}}});
  }
};

TEST_F(Blocks, AColumnThatIsTouchedStands) {
  add_column(8);
  push("grid/7", {3, 0, 0.8});
  start();
  EXPECT_GT(run(2).bodies_awake, 0U);
  run(120);
  EXPECT_EQ(simulator_->statistics().bodies_awake, 0U);
  for (uint32_t i = 1; i < states().size(); ++i) {
    EXPECT_NEAR(states().position[i].y(), kSide * (i - 0.5), 0.003) << i;
    EXPECT_LT(std::hypot(states().position[i].x(), states().position[i].z()), 0.1 * kSide) << i;
  }
}

TEST_F(Blocks, ABlockOverTheEdgeByMoreThanHalfFalls) {
  for (const double shift : {0.4, 0.6}) {
    scene_.bodies.resize(1);
    for (const auto& [name, x, y] :
         {std::tuple("lower", 0.0, 0.1), {"upper", shift * kSide, 0.3}}) {
      Body& body = add_body("cube", {x, y, 0});
      body.name = name;
      body.asleep = true;
    }
    scene_.events.clear();
    push("upper", {0, 0, 0.1});
    start();
    run(60);
    if (shift < 0.5) {
      EXPECT_NEAR(states().position[2].y(), 0.3, 0.003);
    } else {
      EXPECT_LT(states().position[2].y(), 0.2);
    }
  }
}

}  // namespace
}  // namespace pilesim
