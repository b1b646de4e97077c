// Simulated piles held by the least glue.
#include <algorithm>
#include <cmath>
#include <map>

#include "pile/guide/glue_director.h"
#include "pile/guide/guided_simulator.h"
#include "simulate/modes/make_simulator.h"
#include "support/small_model.h"
#include "support/small_simulation.h"

#include <gtest/gtest.h>

namespace pilesim {
namespace {

// A shelf: a fixed cube at a height, with cubes of 0.2 m in a row beside it, face to face.
struct Shelf : SmallModel {
  explicit Shelf(int count) {
    scene.frame_rate = 60;
    scene.step_s = 1.0 / 240;
    scene.guide.emplace();
    const uint32_t wood = material(0, 0.7), cube = box(Vec3::Constant(0.2));
    body(plane(), wood, Vec3::Zero(), Role::fixed);
    body(cube, wood, {0, 2, 0}, Role::fixed);
    for (int i = 1; i <= count; ++i) body(cube, wood, {0.2 * i, 2, 0});
  }
};

TEST(HeldByGlue, AShelfStays) {
  Shelf shelf(3);
  GuidedSimulator simulator(shelf.scene, shelf.model);
  run(simulator, 120);
  const GuideFrame& last = simulator.frames().back();
  EXPECT_EQ(last.counts.glue, 3);
  EXPECT_EQ(last.counts.torn, 0);
  EXPECT_LT(last.largest_drift_m, 0.01);
  ASSERT_TRUE(simulator.glue_figures().has_value());
  EXPECT_TRUE(simulator.glue_figures()->is_solved);
  EXPECT_LT(simulator.glue_figures()->unbalanced, 1e-3);
  // Joints carry 3, 2 and 1 weights by half the friction, 0.7, each with the weight of 3 bodies.
  // Their couples need less, 7 in total.
  EXPECT_NEAR(simulator.glue_figures()->weights, 6 / 0.35 / 3, 0.01);
}

// The filling of a mould is released later: it is held from then on, before it falls.
TEST(HeldByGlue, AShelfThatIsReleasedLaterStays) {
  Shelf shelf(3);
  shelf.model.moulded = {2, 3};
  ModelEvent release{.time_s = 0.5, .kind = ModelEvent::Kind::release, .bodies = {2, 3, 4}};
  shelf.model.events.push_back(release);
  for (uint32_t i = 2; i < 5; ++i) shelf.model.bodies[i].held = true;
  EXPECT_TRUE(judge_start(shelf.scene, shelf.model).hanging.empty());
  GuidedSimulator simulator(shelf.scene, shelf.model);
  run(simulator, 90);
  EXPECT_EQ(simulator.frames().back().counts.glue, 3);
  EXPECT_LT(simulator.frames().back().largest_drift_m, 0.01);
  EXPECT_GT(simulator.states().position[4].y(), 1.99);
}

// A cube of enormous mass: forces are found, but leave the others unbalanced.
TEST(HeldByGlue, SaysWhereNoGlueIsFound) {
  Shelf shelf(3);
  EXPECT_TRUE(judge_start(shelf.scene, shelf.model).holds);
  shelf.model.bodies[4].mass_kg *= 1e12;
  EXPECT_FALSE(judge_start(shelf.scene, shelf.model).holds);
  GuidedSimulator simulator(shelf.scene, shelf.model);
  run(simulator, 2);
  ASSERT_EQ(simulator.notes().size(), 1);
  EXPECT_NE(simulator.notes()[0].find("of a body's weight unbalanced"), std::string::npos);
  EXPECT_FALSE(are_found({.is_solved = false})) << "and with none at all";
}

// Scenes with many bodies have fewer substeps, except with glue, which would tear.
TEST(HeldByGlue, ALongShelfHoldsAmongMany) {
  constexpr int kLength = 32;
  Shelf shelf(kLength);
  const uint32_t cube = shelf.model.bodies[1].shape;
  for (int i = 0; i < 120; ++i) shelf.body(cube, 0, {9 + 0.5 * (i % 10), 0.1, 0.5 * (i / 10)});
  GuidedSimulator simulator(shelf.scene, shelf.model);
  run(simulator, 60);
  EXPECT_EQ(simulator.frames().back().counts.torn, 0);
  EXPECT_GT(simulator.states().position[kLength + 1].y(), 1.5);
}

// The tip of a letter as left by a mould: seven cubes that hang by edges on two fixed ones. The
// least glue has large forces a few millimetres apart.
TEST(HeldByGlue, BodiesThatHangByEdgesStay) {
  struct Place {
    Vec3 position;               // m
    std::array<double, 4> turn;  // x, y, z, w
  };
  const Place places[] = {
      {{-0.15232, -0.00501, -0.10544}, {-0.61269, -0.35301, -0.35302, -0.61268}},
      {{-0.07400, -0.00501, -0.21270}, {0.00001, -0.01470, -0.00000, -0.99989}},
      {{-0.03537, -0.00500, -0.08234}, {0.87763, -0.00000, 0.47934, 0.00000}},
      {{-0.00013, -0.00501, 0.04724}, {-0.20397, 0.67705, 0.67705, -0.20399}},
      {{0.08869, 0.10497, -0.03097}, {-0.47988, 0.51931, -0.51927, 0.47999}},
      {{0.10995, -0.00501, -0.02987}, {0.49991, 0.50009, 0.50010, 0.49990}},
      {{0.09738, 0.07708, 0.12487}, {-0.64623, -0.23900, 0.61542, 0.38279}},
      {{0.10432, -0.00500, 0.23894}, {-0.51195, 0.48775, -0.48775, 0.51195}},
      {{-0.00962, 0.01717, 0.21951}, {-0.61486, -0.32027, 0.65495, 0.30068}},
  };
  Shelf tip(0);
  const uint32_t cube = tip.box(Vec3::Constant(0.11));
  tip.model.bodies.pop_back();
  for (const Place& place : places) {
    const Role role = tip.model.bodies.size() < 3 ? Role::fixed : Role::dynamic;
    const Vec3 at = Vec3(0, 2, 0) + place.position;
    tip.body(cube, 0, at, role).pose.orientation = Quat(place.turn.data()).normalized();
  }
  tip.scene.step_s = 1.0 / 60;
  for (int i = 0; i < 120; ++i) tip.body(cube, 0, {9 + 0.5 * (i % 10), 0.055, 0.5 * (i / 10)});
  GuidedSimulator simulator(tip.scene, tip.model);
  run(simulator, 60);
  EXPECT_EQ(simulator.frames().back().counts.torn, 0);
  EXPECT_LT(simulator.frames().back().largest_drift_m, 0.01);
}

// Crossed sticks as in presets/equilibrium/stick_tower.json: by analysis they stand. With contacts
// as soft as those of large piles without glue, the tower leans by a tenth of a metre in half a
// second and falls.
TEST(HeldByGlue, AHighTowerThatNeedsNoneStands) {
  for (const bool control : {true, false}) {
    SCOPED_TRACE(control);
    Shelf tower(0);
    tower.scene.guide->control = control;
    const uint32_t stick = tower.box({1, 0.02, 0.02});
    for (int layer = 0; layer < 110; ++layer) {
      const double height = layer * 0.01999, turn = 0.02094 * layer + layer % 2 * kPi / 2;
      const Vec3 sway(4 + 0.5 * std::pow(std::sin(1.35 * height), 2), 0.01 + height,
                      0.12 * std::sin(2.8 * height));
      for (const double across : {-0.36, 0.0, 0.36}) {
        tower.body(stick, 0, sway + across * Vec3(std::sin(turn), 0, std::cos(turn)));
        tower.model.bodies.back().pose.orientation = Eigen::AngleAxisd(turn, Vec3::UnitY());
      }
    }
    GuidedSimulator simulator(tower.scene, tower.model);
    run(simulator, 30);
    EXPECT_EQ(simulator.glue_figures()->weights, 0);
    EXPECT_LT(simulator.frames().back().largest_drift_m, 0.01);
  }
}

TEST(HeldByGlue, WithoutControlItFalls) {
  Shelf shelf(3);
  shelf.scene.guide->control = false;
  GuidedSimulator simulator(shelf.scene, shelf.model);
  run(simulator, 120);
  EXPECT_GT(simulator.frames().back().largest_drift_m, 1);
  EXPECT_GT(simulator.glue_figures()->weights, 1) << "it is analysed all the same";
}

TEST(HeldByGlue, WithLessItSlumpsUntilItStands) {
  const double needed = 6 / 0.35 / 3;
  for (const double most : {0.5, 0.05}) {
    SCOPED_TRACE(most);
    Shelf shelf(3);
    shelf.scene.guide->max_glue = most;
    GuidedSimulator simulator(shelf.scene, shelf.model);
    run(simulator, 2);
    EXPECT_NEAR(simulator.glue_figures()->weights, needed, 0.01);
    EXPECT_NEAR(simulator.glue_figures()->given, most / needed, 1e-3);
    run(simulator, 298);
    const auto& place = simulator.states().position;
    for (const size_t cube : {2, 3, 4}) EXPECT_LT(place[cube].y(), 0.5);
    // Analysed again where they lie, on the ground and against each other.
    EXPECT_LT(simulator.glue_figures()->weights, 1);
    EXPECT_GT(simulator.glue_figures()->given, most / needed);
  }
}

TEST(HeldByGlue, OfNoneAllowedNoneIsPutOn) {
  Shelf shelf(3);
  shelf.scene.guide->max_glue = 0;
  GuidedSimulator simulator(shelf.scene, shelf.model);
  run(simulator, 60);
  EXPECT_TRUE(simulator.glue().empty());
  EXPECT_GT(simulator.frames().back().largest_drift_m, 1);
}

TEST(HeldByGlue, AStandingPileNeedsNone) {
  Shelf column(0);
  const uint32_t cube = column.model.bodies[1].shape;
  for (int i = 0; i < 4; ++i) column.body(cube, 0, {2, 0.1 + 0.2 * i, 0});
  GuidedSimulator simulator(column.scene, column.model);
  run(simulator, 10);
  EXPECT_EQ(simulator.frames().back().counts.glue, 0);
  EXPECT_EQ(simulator.glue_figures()->weights, 0);
  EXPECT_EQ(simulator.frames().back().counts.passed, 4);
}

TEST(HeldByGlue, AHitTearsIt) {
  Shelf shelf(3);
  const double mass_kg = shelf.model.bodies[4].mass_kg;
  shelf.model.events.push_back({0.5, ModelEvent::Kind::impulse, {4}, Vec3(0, -6 * mass_kg, 0), {}});
  GuidedSimulator simulator(shelf.scene, shelf.model);
  run(simulator, 29);
  EXPECT_EQ(simulator.frames().back().counts.torn, 0);
  run(simulator, 90);
  EXPECT_GE(simulator.frames().back().counts.torn, 1);
  EXPECT_LT(simulator.states().position[4].y(), 0.5);
  const std::vector<PairLine> glue = simulator.glue();
  EXPECT_TRUE(std::ranges::any_of(glue, [](const PairLine& line) {
    return line.until_s > 0.49 && std::isfinite(line.until_s);
  }));
}

// The pile after an impact is analysed once it is at rest: two cubes beside a fixed one still hang
// by strong enough glue, the third lies on the ground.
TEST(HeldByGlue, ThePileAfterAnImpactIsAnalysedAgain) {
  Shelf shelf(3);
  const double mass_kg = shelf.model.bodies[4].mass_kg;
  shelf.model.events.push_back({0.5, ModelEvent::Kind::impulse, {4}, Vec3(0, -6 * mass_kg, 0), {}});
  shelf.model.events.push_back({3.1, ModelEvent::Kind::impulse, {3}, Vec3(0, -9 * mass_kg, 0), {}});
  GuidedSimulator simulator(shelf.scene, shelf.model);
  run(simulator, 40);
  EXPECT_FALSE(simulator.glue_left().has_value());
  run(simulator, 140);
  const std::optional<GlueLeft> left = simulator.glue_left();
  ASSERT_TRUE(left.has_value());
  EXPECT_GT(left->time_s, 0.5);
  EXPECT_TRUE(left->is_solved);
  EXPECT_EQ(left->bodies, 3);
  EXPECT_EQ(left->hanging, 0);
  EXPECT_EQ(left->pairs, 2);
  EXPECT_EQ(left->needed, 2);
  EXPECT_LT(left->missing, 1e-4);
  EXPECT_LT(left->unbalanced, 1e-5);
  const std::vector<PairLine> forces = simulator.forces();
  EXPECT_EQ(std::ranges::count_if(
                forces, [](const PairLine& line) { return !std::isfinite(line.until_s); }),
            3)
      << "two of the shelf and one of the ground";
  EXPECT_EQ(simulator.frames().back().counts.glue, 2) << "nothing is glued again";
  run(simulator, 20);
  EXPECT_LT(simulator.frames().back().counts.glue, 2);
  EXPECT_FALSE(simulator.glue_left().has_value())
      << "it is hit once more, and has not come to rest";
}

// A cube that comes to rest beside a mould's filling, inside the guide, does not belong to it.
TEST(HeldByGlue, TheFillingOfAMouldIsGluedOnce) {
  for (const bool is_moulded : {true, false}) {
    SCOPED_TRACE(is_moulded);
    Shelf shelf(3);
    if (is_moulded) shelf.model.moulded = {2, 3};
    shelf.body(shelf.model.bodies[1].shape, 0, {2, 0.1, 0}).start_s = 0.5;
    GuidedSimulator simulator(shelf.scene, shelf.model);
    run(simulator, 60);
    EXPECT_EQ(simulator.frames().back().counts.in_guide, is_moulded ? 3 : 4);
    EXPECT_EQ(simulator.frames().back().counts.glue, 3);
    const std::vector<PairLine> glue = simulator.glue();
    EXPECT_EQ(std::ranges::count_if(glue, [](const PairLine& line) { return line.from_s < 0.1; }),
              is_moulded ? 3 : 0);
  }
}

TEST(HeldByGlue, TellsTheForcesItStandsBy) {
  // Three cubes beside a fixed one, one below it, and two on each other.
  Shelf shelf(3);
  const uint32_t cube = shelf.model.bodies[1].shape;
  shelf.body(cube, 0, {0, 1.8, 0});
  shelf.body(cube, 0, {2, 0.1, 0});
  shelf.body(cube, 0, {2, 0.3, 0});
  GuidedSimulator simulator(shelf.scene, shelf.model);
  run(simulator, 2);
  std::map<std::pair<uint32_t, uint32_t>, double> weights;
  for (const PairLine& line : simulator.forces()) {
    weights[std::pair(line.a, line.b)] = line.weights;
    EXPECT_EQ(line.b_stands, line.b < 2);
    EXPECT_LE(line.arm.cwiseAbs().maxCoeff(), 0.105) << "on the cube";
  }
  const std::map<std::pair<uint32_t, uint32_t>, double> wanted = {
      {{2, 1}, 3}, {{2, 3}, 2}, {{3, 4}, 1}, {{5, 1}, -1}, {{6, 0}, 2}, {{6, 7}, 1}};
  ASSERT_EQ(weights.size(), wanted.size());
  for (const auto& [pair, force] : wanted) {
    ASSERT_TRUE(weights.contains(pair)) << pair.first << " " << pair.second;
    EXPECT_NEAR(weights[pair], force, 1e-3) << pair.first << " " << pair.second;
  }
}

TEST(HeldByGlue, ForcesEndWithThePlacesOfTheirBodies) {
  Shelf row(0);
  const uint32_t cube = row.model.bodies[1].shape;
  for (int i = 0; i < 12; ++i) row.body(cube, 0, {1 + 0.5 * i, 0.1, 0});
  const double mass_kg = row.model.bodies[2].mass_kg;
  const auto jump = [&](double time_s, uint32_t body) {
    row.model.events.push_back(
        {time_s, ModelEvent::Kind::impulse, {body}, Vec3(0, 3 * mass_kg, 0), {}});
  };
  jump(0.5, 4);
  jump(0.7, 9);
  GuidedSimulator simulator(row.scene, row.model);
  const auto lasting = [&] {
    return std::ranges::count_if(simulator.forces(),
                                 [](const PairLine& line) { return !std::isfinite(line.until_s); });
  };
  run(simulator, 29);
  EXPECT_EQ(lasting(), 12);
  run(simulator, 12);
  EXPECT_EQ(lasting(), 11) << "that of the cube that jumped";
  run(simulator, 12);
  EXPECT_EQ(lasting(), 0) << "more than a tenth are gone";
}

// A spot that holds a cube under another.
class OneSpot final : public ImpulseDirector {
 public:
  OneSpot(double strength_n, double strength_nm) : n_(strength_n), nm_(strength_nm) {}
  void direct(ImpulseControl& control) override {
    if (step_++ == 0) {
      id = control.add_glue({.a = 2,
                             .b = 1,
                             .point = Vec3(0.1, 2, 0),
                             .strength_n = n_,
                             .strength_nm = nm_,
                             .tears_m = 0.02,
                             .tears_rad = 0.1});
    }
    holds = control.holds(id);
  }
  ConstraintId id = 0;
  bool holds = false;

 private:
  double n_, nm_;
  int step_ = 0;
};

TEST(HeldByGlue, ASpotHoldsAsMuchAsItsStrength) {
  Shelf shelf(1);
  shelf.model.materials[0].friction = 0;
  const double weight_n = 9.81 * shelf.model.bodies[2].mass_kg, couple_nm = 0.1 * weight_n;
  const auto holds = [&](double force, double torque) {
    OneSpot director(force * weight_n, torque * couple_nm);
    const auto simulator =
        make_directed_simulator(shelf.scene, shelf.model, static_cast<ImpulseDirector&>(director));
    for (int frame = 0; frame < 90; ++frame) simulator->step_frame();
    return director.holds && std::abs(simulator->states().position[2].y() - 2) < 0.005;
  };
  EXPECT_TRUE(holds(1.1, 1.1));
  EXPECT_FALSE(holds(0.9, 1.1));
  // The wall that it leans on takes part of the couple: without the wall it turns.
  EXPECT_FALSE(holds(1.1, 0));
}

// Glues two bodies once, permanently.
class GluesTwo final : public ImpulseDirector {
 public:
  explicit GluesTwo(const Vec3& point, double strength_n = 1e6, double strength_nm = 1e6)
      : point_(point), strength_n_(strength_n), strength_nm_(strength_nm) {}
  void direct(ImpulseControl& control) override {
    if (is_glued_) return;
    is_glued_ = true;
    control.add_glue({.a = 0,
                      .b = 1,
                      .point = point_,
                      .strength_n = strength_n_,
                      .strength_nm = strength_nm_,
                      .tears_m = 1,
                      .tears_rad = 3});
  }

 private:
  Vec3 point_;
  double strength_n_, strength_nm_;
  bool is_glued_ = false;
};

struct Weightless : SmallModel {
  Weightless() {
    scene.step_s = 1.0 / 60;
    scene.frame_rate = 60;
    scene.gravity = Vec3::Zero();
  }
  // Away from the others, so that the scene has many bodies.
  void add_others(uint32_t shape, uint32_t material, int count) {
    for (int i = 0; i < count; ++i) {
      body(shape, material, {5 + 0.5 * (i % 12), 5, 0.5 * (i / 12)});
    }
  }
};

// Two sticks glued into an L, like chairs torn off a pile together: nothing adds energy, however
// fast they turn, in the steps of many bodies and of few.
TEST(HeldByGlue, AFastSpinGainsNoEnergy) {
  for (const int others : {0, 120}) {
    Weightless pair;
    const uint32_t wood = pair.material(0, 0.5), stick = pair.box({0.3, 0.06, 0.06});
    for (const Vec3& place : {Vec3(0, 0, 0), Vec3(0.12, 0, 0.18)}) pair.body(stick, wood, place);
    pair.model.bodies[1].pose.orientation = Quat(Eigen::AngleAxisd(kPi / 2, Vec3::UnitY()));
    pair.add_others(stick, wood, others);
    const Vec3 spin(20, 150, 30), middle(0.06, 0, 0.09);
    for (int i = 0; i < 2; ++i) {
      ModelBody& body = pair.model.bodies[i];
      body.angular_velocity = spin;
      body.linear_velocity = spin.cross(body.pose.position - middle);
    }
    GluesTwo director(Vec3(0.12, 0, 0.03));
    const auto simulator =
        make_directed_simulator(pair.scene, pair.model, static_cast<ImpulseDirector&>(director));
    const double energy_j = simulator->statistics().kinetic_energy_j;
    EXPECT_GT(energy_j, 400);
    for (int frame = 0; frame < 120; ++frame) {
      EXPECT_LT(simulator->step_frame().kinetic_energy_j, 1.01 * energy_j)
          << "frame " << frame << " among " << others;
    }
  }
}

// A body pulled aside farther than its glue is strong does not spin faster: both ends of a
// stretched spot receive the force at one point.
TEST(HeldByGlue, GlueThatStretchesGivesNoSpin) {
  for (const int others : {0, 120}) {
    Weightless pair;
    const uint32_t wood = pair.material(0, 0), cube = pair.box(Vec3::Constant(0.2));
    for (const double x : {0.0, 0.25}) pair.body(cube, wood, {x, 0, 0});
    const double kg = pair.model.bodies[0].mass_kg, kgm2 = kg * 0.2 * 0.2 / 6;
    pair.model.bodies[1].linear_velocity = {0.3, 0.7, 0.2};
    pair.add_others(cube, wood, others);
    GluesTwo director({0.125, 0, 0}, 5 * kg, 0.1 * kg);
    const auto simulator =
        make_directed_simulator(pair.scene, pair.model, static_cast<ImpulseDirector&>(director));
    const auto momentum = [&] {
      const BodyStates& states = simulator->states();
      Vec3 sum = Vec3::Zero();
      for (const size_t i : {0, 1}) {
        sum += kg * states.position[i].cross(states.linear_velocity[i]) +
               kgm2 * states.angular_velocity[i];
      }
      return sum;
    };
    const Vec3 before = momentum();
    for (int frame = 0; frame < 120; ++frame) {
      simulator->step_frame();
      EXPECT_LT((momentum() - before).norm(), 0.01 * before.norm())
          << "frame " << frame << " among " << others;
    }
    const Vec3 way = simulator->states().position[1] - simulator->states().position[0];
    EXPECT_LT(way.norm(), 0.5) << "it holds";
  }
}

// Glues all touching pairs, with different strengths; the ground is the last body.
class GluesAllThatTouch final : public ImpulseDirector {
 public:
  explicit GluesAllThatTouch(double weight_n) : weight_n_(weight_n) {}
  void direct(ImpulseControl& control) override {
    if (step_++ != 1) return;
    std::vector<BodyContact> contacts;
    control.read_contacts(contacts);
    std::map<std::pair<uint32_t, uint32_t>, Vec3> pairs;
    for (const BodyContact& contact : contacts) {
      pairs[std::minmax(contact.a, contact.b)] = contact.point;
    }
    for (const auto& [pair, point] : pairs) {
      const double weights = 20 * std::pow(4.0, (pair.first * 7 + pair.second * 3) % 5);
      control.add_glue({.a = pair.first,
                        .b = pair.second,
                        .point = point,
                        .strength_n = weights * weight_n_,
                        .strength_nm = 0.03 * weights * weight_n_,
                        .tears_m = 0.03,
                        .tears_rad = 0.3});
    }
  }

 private:
  double weight_n_;
  int step_ = 0;
};

// The rest of a pile after an impact, glued throughout and partly stretched for good, hardly
// swings. With weakly damped glue it swung at 2 m/s for ever.
TEST(HeldByGlue, WhatIsLeftHardlySwings) {
  SmallModel pile;
  pile.scene.step_s = 1.0 / 60;
  pile.scene.frame_rate = 60;
  const uint32_t wood = pile.material(0, 0.5), cube = pile.box(Vec3::Constant(0.1));
  for (int i = 0; i < 72; ++i) {
    pile.body(cube, wood, {0.1 * (i % 2), 0.05 + 0.1 * (i / 6), 0.1 * (i / 2 % 3)});
  }
  for (int i = 0; i < 60; ++i) pile.body(cube, wood, {9 + 0.5 * (i % 10), 0.05, 0.5 * (i / 10)});
  pile.body(pile.plane(), wood, Vec3::Zero(), Role::fixed);
  const double kg = pile.model.bodies[0].mass_kg;
  for (uint32_t i = 48; i < 72; ++i) {
    pile.model.events.push_back({0.5, ModelEvent::Kind::impulse, {i}, Vec3(2 * kg, 0, kg), {}});
  }
  GluesAllThatTouch director(9.81 * kg);
  const auto simulator =
      make_directed_simulator(pile.scene, pile.model, static_cast<ImpulseDirector&>(director));
  for (int frame = 0; frame < 400; ++frame) simulator->step_frame();
  for (size_t i = 0; i < 72; ++i) {
    EXPECT_LT(simulator->states().linear_velocity[i].norm(), 0.005) << i;
  }
}

// Glue of any strength holds a tower after an impact, and lets it come to rest.
TEST(HeldByGlue, ATowerComesToRestAfterAHit) {
  for (const double strength : {1.0, 1000.0}) {
    SmallModel pile;
    pile.scene.frame_rate = 60;
    const uint32_t wood = pile.material(0, 0.5), cube = pile.box(Vec3::Constant(0.1));
    for (int i = 0; i < 24; ++i) {
      pile.body(cube, wood, {0.1 * (i % 2), 0.05 + 0.1 * (i / 2), 0});
    }
    pile.body(pile.plane(), wood, Vec3::Zero(), Role::fixed);
    const double kg = pile.model.bodies[0].mass_kg;
    for (uint32_t i = 16; i < 24; ++i) {
      pile.model.events.push_back({0.5, ModelEvent::Kind::impulse, {i}, Vec3(kg, 0, kg / 2), {}});
    }
    GluesAllThatTouch director(9.81 * kg * strength);
    const auto simulator =
        make_directed_simulator(pile.scene, pile.model, static_cast<ImpulseDirector&>(director));
    for (int frame = 0; frame < 180; ++frame) simulator->step_frame();
    for (size_t i = 0; i < 24; ++i) {
      EXPECT_LT(simulator->states().linear_velocity[i].norm(), 0.02) << i << " at " << strength;
      EXPECT_LT((simulator->states().position[i] - pile.model.bodies[i].pose.position).norm(),
                0.01);
    }
  }
}

TEST(HeldByGlue, GoesOnFromASavedState) {
  const Shelf shelf(3);
  GuidedSimulator first(shelf.scene, shelf.model), second(shelf.scene, shelf.model);
  run(first, 20);
  StateWriter writer;
  first.save(writer);
  StateReader reader(writer.bytes());
  second.load(reader);
  run(first, 20);
  run(second, 20);
  for (size_t i = 0; i < shelf.model.bodies.size(); ++i) {
    EXPECT_EQ(first.states().position[i], second.states().position[i]);
  }
  EXPECT_EQ(first.glue().size(), second.glue().size());
  const std::vector<PairLine> forces = first.forces(), others = second.forces();
  ASSERT_EQ(forces.size(), others.size());
  for (size_t i = 0; i < forces.size(); ++i) EXPECT_EQ(forces[i].weights, others[i].weights);
}

// Also between an impact and the analysis after it.
TEST(HeldByGlue, GoesOnFromAStateSavedAfterAHit) {
  Shelf shelf(3);
  const double mass_kg = shelf.model.bodies[4].mass_kg;
  shelf.model.events.push_back({0.5, ModelEvent::Kind::impulse, {4}, Vec3(0, -6 * mass_kg, 0), {}});
  GuidedSimulator first(shelf.scene, shelf.model), second(shelf.scene, shelf.model);
  run(first, 50);
  EXPECT_FALSE(first.glue_left().has_value());
  StateWriter writer;
  first.save(writer);
  StateReader reader(writer.bytes());
  second.load(reader);
  run(first, 130);
  run(second, 130);
  ASSERT_TRUE(first.glue_left().has_value());
  ASSERT_TRUE(second.glue_left().has_value());
  EXPECT_EQ(first.glue_left()->time_s, second.glue_left()->time_s);
  EXPECT_EQ(first.glue_left()->weights, second.glue_left()->weights);
  EXPECT_EQ(first.glue_left()->pairs, second.glue_left()->pairs);
}

}  // namespace
}  // namespace pilesim
