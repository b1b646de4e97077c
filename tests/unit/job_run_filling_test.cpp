// Bodies of a guide taken from a run instead of another filling.
#include "job/run_filling.h"

#include <gtest/gtest.h>

#include "support/small_model.h"

namespace pilesim {
namespace {

// Cubes and balls in turn that should fill a guide, among other bodies.
struct Filled : SmallModel {
  explicit Filled(bool is_mould) {
    const uint32_t stone = material(0, 0.5), wood = material(0, 0.7, 500);
    const uint32_t cube = box(Vec3::Constant(0.1)), ball = sphere(0.1);
    body(plane(), stone, Vec3::Zero(), Role::fixed).name = "ground";
    for (int i = 0; i < 6; ++i) {
      body(i % 2 == 0 ? cube : ball, i % 2 == 0 ? wood : stone, Vec3::Zero()).name =
          "pile/" + std::to_string(i);
      model.bodies.back().start_s = 1;
    }
    body(ball, stone, {2, 1, 0}).name = "thrown";
    model.guide_fill = {1, 6, 0, is_mould};
    model.events.push_back({2, ModelEvent::Kind::remove, {2, 5, 7}, Vec3::Zero(), {}});
  }
};

// Two of them were removed, so that names belong to other shapes.
TrajectoryHeader run_of(const std::vector<std::pair<std::string, uint32_t>>& bodies) {
  TrajectoryHeader run;
  for (const char* name : {"box", "sphere", "plane"}) run.shapes.push_back({.name = name});
  for (const auto& [name, shape] : bodies) {
    run.body_name.push_back(name);
    run.body_shape.push_back(shape);
    run.body_material.push_back(shape == 0 ? 1 : 0);
  }
  return run;
}

TEST(RunFilling, IsAsTheRunHasIt) {
  for (const bool is_mould : {true, false}) {
    SCOPED_TRACE(is_mould);
    Filled world(is_mould);
    const double cube_kg = world.model.bodies[1].mass_kg, ball_kg = world.model.bodies[2].mass_kg;
    const TrajectoryHeader run = run_of(
        {{"ground", 2}, {"pile/0", 1}, {"pile/1", 1}, {"pile/2", 0}, {"pile/3", 0}, {"thrown", 1}});
    take_filling(run, {true, true, true, true, false, true}, world.model);
    const std::vector<ModelBody>& bodies = world.model.bodies;
    ASSERT_EQ(bodies.size(), 5);
    const char* names[] = {"ground", "pile/0", "pile/1", "pile/2", "thrown"};
    for (size_t i = 0; i < 5; ++i) EXPECT_EQ(bodies[i].name, names[i]);
    for (const size_t ball : {1, 2}) {
      EXPECT_EQ(world.model.shapes[bodies[ball].shape].name, "sphere");
      EXPECT_EQ(bodies[ball].mass_kg, ball_kg);
      EXPECT_EQ(bodies[ball].material, 0);
    }
    EXPECT_EQ(world.model.shapes[bodies[3].shape].name, "box");
    EXPECT_EQ(bodies[3].mass_kg, cube_kg);
    EXPECT_EQ(bodies[3].material, 1);
    EXPECT_EQ(bodies[3].start_s, kFromTheStart);
    EXPECT_EQ(world.model.events[0].bodies, (std::vector<uint32_t>{2, 4}));
    EXPECT_FALSE(world.model.guide_fill.has_value());
    ASSERT_EQ(world.model.moulded.has_value(), is_mould);
    if (!is_mould) continue;
    for (uint32_t i = 0; i < 5; ++i) EXPECT_EQ(world.model.moulded->contains(i), i > 0 && i < 4);
  }
}

TEST(RunFilling, ARunWithoutItLeavesItToBeFilled) {
  Filled world(true);
  take_filling(run_of({{"ground", 2}, {"thrown", 1}}), {true, true}, world.model);
  EXPECT_EQ(world.model.bodies.size(), 8);
  EXPECT_TRUE(world.model.guide_fill.has_value());
}

}  // namespace
}  // namespace pilesim
