// Methods for pairs: Table 4.1 and the rules of a scene.

#include "simulate/sphere/dispatch_table.h"

#include <gtest/gtest.h>

namespace pilesim {
namespace {

using enum Behaviour;
constexpr PairMethod none = PairMethod::none, impulse = PairMethod::impulse,
                     particle = PairMethod::particle;

// Bodies: 0 and 1 must-impulse, 2 and 3 prefer-statistical, 4 a prefer-statistical ground, 5
// another one.
Model six_bodies() {
  Model model;
  model.bodies.resize(6);
  model.shapes.resize(1);
  for (const size_t i : {0, 1}) model.bodies[i].preference = Preference::must_impulse;
  for (const size_t i : {4, 5}) model.bodies[i].role = Role::fixed;
  return model;
}

PairMethod of_pair(DispatchTable& table, Behaviour a, uint32_t level_a, Behaviour b,
                   uint32_t level_b) {
  table.set(2, a, level_a);
  table.set(3, b, level_b);
  EXPECT_EQ(table.method(2, 3), table.method(3, 2));
  return table.method(2, 3);
}

LevelOfDetail table_4_1() {
  LevelOfDetail detail;
  detail.levels = LevelOfDetail::table_4_1();
  return detail;
}

TEST(DispatchTable, IsTableFourOne) {
  DispatchTable table(table_4_1(), six_bodies());
  const struct {
    Behaviour a, b;
    std::array<PairMethod, 3> at_level;
  } rows[] = {
      {exact, exact, {impulse, impulse, impulse}},
      {exact, near_exact, {impulse, impulse, impulse}},
      {exact, standing, {impulse, impulse, impulse}},
      {exact, statistical, {none, none, none}},  // the update rule prevents it
      {near_exact, near_exact, {impulse, PairMethod::statistical, particle}},
      {near_exact, standing, {impulse, PairMethod::statistical, particle}},
      {near_exact, statistical, {PairMethod::statistical, PairMethod::statistical, particle}},
      {statistical, statistical, {PairMethod::statistical, PairMethod::statistical, particle}},
      {statistical, standing, {PairMethod::statistical, PairMethod::statistical, particle}},
      {standing, standing, {none, none, none}}};
  for (const auto& row : rows) {
    for (uint32_t level = 0; level < 3; ++level) {
      EXPECT_EQ(of_pair(table, row.a, level, row.b, level), row.at_level[level])
          << static_cast<int>(row.a) << ", " << static_cast<int>(row.b) << " at " << level;
    }
  }
}

TEST(DispatchTable, KnowsWhetherSpheresMayBeSolved) {
  LevelOfDetail detail;
  EXPECT_TRUE(DispatchTable(detail, six_bodies()).may_solve_spheres());
  detail.level = 2;  // level 1 is then out of reach
  EXPECT_FALSE(DispatchTable(detail, six_bodies()).may_solve_spheres());
  EXPECT_FALSE(DispatchTable(detail, six_bodies()).may_solve_standing());
  Model model = six_bodies();
  model.pair_rules = {{{2}, {3}, impulse}};
  EXPECT_TRUE(DispatchTable(detail, model).may_solve_spheres());
  detail.level = 1;
  model.pair_rules = {{{2, 3, 4, 5}, {2, 3, 4, 5}, particle}};
  EXPECT_FALSE(DispatchTable(detail, model).may_solve_spheres());
  EXPECT_FALSE(DispatchTable(detail, model).may_solve_standing());
  model.pair_rules = {{{2, 3}, {2, 3}, particle}};  // the ground is left
  EXPECT_FALSE(DispatchTable(detail, model).may_solve_spheres());
  EXPECT_TRUE(DispatchTable(detail, model).may_solve_standing());
}

TEST(DispatchTable, PairsHaveTheFinerLevelOfTheTwo) {
  DispatchTable table(table_4_1(), six_bodies());
  EXPECT_EQ(of_pair(table, statistical, 2, statistical, 0), PairMethod::statistical);
  EXPECT_EQ(of_pair(table, statistical, 2, statistical, 2), particle);
  EXPECT_EQ(of_pair(table, near_exact, 2, near_exact, 0), impulse);
  // Standing bodies have no level of their own.
  EXPECT_EQ(of_pair(table, statistical, 2, standing, 0), particle);
}

TEST(DispatchTable, BodiesBeginByTheirPreferenceAndRole) {
  const LevelOfDetail detail;
  const DispatchTable table(detail, six_bodies());
  EXPECT_EQ(table.method(0, 1), impulse);
  EXPECT_EQ(table.method(0, 2), none);
  EXPECT_EQ(table.method(2, 3), PairMethod::statistical);
  EXPECT_EQ(table.method(2, 4), PairMethod::statistical);
  EXPECT_EQ(table.method(4, 5), none);
}

TEST(DispatchTable, RulesForPairsComeBeforeLevelsAndTheLastOneWins) {
  Model model = six_bodies();
  model.pair_rules = {{{2}, {1, 3}, PairMethod::statistical}, {{3}, {2}, particle}};
  const LevelOfDetail detail;
  DispatchTable table(detail, model);
  EXPECT_EQ(of_pair(table, near_exact, 0, near_exact, 0), particle);
  EXPECT_EQ(table.method(1, 2), PairMethod::statistical);
  EXPECT_EQ(table.method(0, 2), impulse);
  EXPECT_FALSE(table.attracts(1, 2));
  EXPECT_TRUE(table.attracts(0, 2));
  EXPECT_TRUE(table.attracts(1, 3));
  EXPECT_TRUE(table.is_sphere_surface(1));
  EXPECT_FALSE(table.is_sphere_surface(0));
}

TEST(DispatchTable, KnowsWhichMethodsItUses) {
  LevelOfDetail detail;
  EXPECT_TRUE(DispatchTable(detail, six_bodies()).uses(particle));
  detail.levels = {{.near_near = impulse, .near_far = particle, .far_far = particle}};
  EXPECT_FALSE(DispatchTable(detail, six_bodies()).uses(PairMethod::statistical));
  Model model = six_bodies();
  model.pair_rules = {{{2}, {3}, PairMethod::statistical}};
  EXPECT_TRUE(DispatchTable(detail, model).uses(PairMethod::statistical));
}

}  // namespace
}  // namespace pilesim
