// Piles of penetrating bodies, brought to rest.

#include <gtest/gtest.h>

#include <cmath>

#include "core/parallel_for.h"
#include "finish/burial.h"
#include "finish/exact_rest.h"
#include "finish/walls.h"
#include "inspect/pile_inspection.h"
#include "support/small_model.h"

namespace pilesim {
namespace {

constexpr double kSide = 0.2;  // m, of the boxes

struct Pile : SmallModel {
  Pile() {
    stuff = material(0.5, 0.5);
    ground = plane();
    crate = box(Vec3::Constant(kSide));
    body(ground, stuff, Vec3::Zero(), Role::fixed);
  }
  void add(const Vec3& position) { body(crate, stuff, position); }
  uint32_t stuff = 0, ground = 0, crate = 0;
};

// Columns of boxes, slightly rotated, each a third inside the next one.
Pile sunk_pile(int side, int layers) {
  Pile pile;
  for (int y = 0; y < layers; ++y) {
    for (int x = 0; x < side; ++x) {
      for (int z = 0; z < side; ++z) {
        pile.add(Vec3(x, y, z) * (0.66 * kSide) + Vec3(0.002 * y, kSide / 2, 0.003 * (x + y)));
        pile.model.bodies.back().pose.orientation =
            Quat(Eigen::AngleAxisd(0.1 * (x - z) + 0.05 * y, Vec3(1, 2, 1).normalized()));
      }
    }
  }
  return pile;
}

void finish(ExactRest& rest) {
  while (!rest.is_over()) rest.step();
}

TEST(FinishRest, OverlappingBodiesEndSound) {
  const Pile pile = sunk_pile(4, 4);
  ExactRest rest(pile.scene, pile.model, pile.states());
  const PileQuality before = inspect_pile(pile.model, pile.scene.gravity, pile.states());
  ASSERT_GT(before.deepest_penetration_m, 0.15 * kSide);
  finish(rest);
  EXPECT_TRUE(rest.is_at_rest());
  const PileQuality after = inspect_pile(pile.model, pile.scene.gravity, rest.states());
  EXPECT_LT(after.deepest_penetration_m, 0.02 * after.body_diameter_m);
  EXPECT_EQ(after.unsettled, 0U);
  EXPECT_EQ(after.floating, 0U);
  EXPECT_EQ(after.escaped, 0U);
  for (size_t i = 1; i < pile.model.bodies.size(); ++i) {
    EXPECT_NE(rest.states().flags[i] & kAsleep, 0) << i;
  }
}

// Energy comes only from the heights that bodies lose, not from their overlaps.
TEST(FinishRest, NothingIsShotOut) {
  const Pile pile = sunk_pile(3, 3);
  ExactRest rest(pile.scene, pile.model, pile.states());
  const double fall = std::sqrt(2 * 9.81 * 4 * kSide);
  double fastest = 0;
  while (!rest.is_over()) {
    rest.step();
    for (const Vec3& velocity : rest.states().linear_velocity) {
      fastest = std::max(fastest, velocity.norm());
    }
  }
  EXPECT_LT(fastest, fall);
  for (const Vec3& position : rest.states().position) EXPECT_LT(position.norm(), 10 * kSide);
}

TEST(FinishRest, ASoundTowerStaysAsItIs) {
  Pile pile;
  for (int i = 0; i < 8; ++i) pile.add({0, (i + 0.5) * kSide, 0});
  ExactRest rest(pile.scene, pile.model, pile.states());
  finish(rest);
  EXPECT_TRUE(rest.is_at_rest());
  for (size_t i = 1; i < pile.model.bodies.size(); ++i) {
    EXPECT_LT((rest.states().position[i] - pile.states().position[i]).norm(), 0.01 * kSide) << i;
  }
  EXPECT_TRUE(rest.take_ways().empty());
}

TEST(FinishRest, WallsHold) {
  Pile pile;
  const uint32_t wall = pile.box({0.02, 1, 0.6}), across = pile.box({0.6, 1, 0.02});
  for (const double sign : {1.0, -1.0}) {
    pile.body(wall, pile.stuff, {sign * 0.31, 0.5, 0}, Role::fixed);
    pile.body(across, pile.stuff, {0, 0.5, sign * 0.31}, Role::fixed);
  }
  // Two across the vessel and two thirds of another one; some reach into the walls.
  for (int y = 0; y < 3; ++y) {
    for (int x = 0; x < 3; ++x) {
      for (int z = 0; z < 3; ++z) {
        pile.add({0.21 * (x - 1), 0.1 + 0.14 * y, 0.21 * (z - 1)});
      }
    }
  }
  ExactRest rest(pile.scene, pile.model, pile.states());
  finish(rest);
  for (size_t i = 5; i < pile.model.bodies.size(); ++i) {
    const Vec3& position = rest.states().position[i];
    EXPECT_LT(std::max(std::abs(position.x()), std::abs(position.z())), 0.3) << i;
  }
  const PileQuality after = inspect_pile(pile.model, pile.scene.gravity, rest.states());
  EXPECT_LT(after.deepest_penetration_m, 0.02 * after.body_diameter_m);
}

// A stick whose end is through a thin wall moves back along the wall's normal, no farther than
// necessary.
TEST(FinishRest, ABodyThroughAThinWallIsDrawnBack) {
  Pile pile;
  const uint32_t wall = pile.box({0.02, 1, 2});
  pile.body(wall, pile.stuff, {0, 0.5, 0}, Role::fixed);
  const uint32_t stick = pile.box({0.6, 0.05, 0.05});
  pile.body(stick, pile.stuff, {-0.05, 0.2, 0});
  pile.body(stick, pile.stuff, {-0.4, 0.5, 0});
  BodyStates states = pile.states();
  draw_back_from_walls(pile.model, {2, 3}, {0, 1}, states);
  EXPECT_NEAR(states.position[2].x(), -0.31, 1e-9);
  EXPECT_NEAR(states.position[2].y(), 0.2, 1e-9);
  EXPECT_EQ(states.position[3], pile.states().position[3]);
}

TEST(FinishRest, ABodyThroughAThinWallEndsBesideIt) {
  Pile pile;
  const uint32_t wall = pile.box({0.02, 1, 2});
  pile.body(wall, pile.stuff, {0, 0.5, 0}, Role::fixed);
  const uint32_t stick = pile.box({0.6, 0.05, 0.05});
  for (const double z : {-0.4, 0.0, 0.4}) pile.body(stick, pile.stuff, {-0.05, 0.03, z});
  ExactRest rest(pile.scene, pile.model, pile.states());
  finish(rest);
  for (size_t i = 2; i < pile.model.bodies.size(); ++i) {
    EXPECT_LT(rest.states().position[i].x(), -0.3) << i;
    EXPECT_NEAR(rest.states().position[i].y(), 0.025, 0.002) << i;
  }
}

TEST(FinishRest, FixedAndFrozenBodiesStayAndAbsentOnesStayAway) {
  Pile pile;
  pile.add({0, 1, 0});       // fixed in mid-air
  pile.add({2, 1, 0});       // frozen by a guide
  pile.add({0.05, 1.1, 0});  // inside the first one
  pile.add({4, 0.1, 0});     // absent
  pile.add({4, 0.15, 0});
  BodyStates start = pile.states();
  start.flags[1] |= kHeld;
  start.flags[2] |= kFrozen;
  start.flags[4] = 0;
  ExactRest rest(pile.scene, pile.model, start);
  EXPECT_EQ(rest.movable(), 2U);
  finish(rest);
  for (const size_t stands : {1, 2, 4}) {
    EXPECT_EQ(rest.states().position[stands], start.position[stands]) << stands;
    EXPECT_EQ(rest.states().flags[stands], start.flags[stands]) << stands;
  }
  EXPECT_NEAR(rest.states().position[3].y(), 1 + kSide, 0.01);
  EXPECT_NEAR(rest.states().position[5].y(), kSide / 2, 0.001);
}

TEST(FinishRest, EndsAtTheLongestTimeAndSaysSo) {
  Pile pile;
  pile.add({0, 5, 0});
  ExactRest rest(pile.scene, pile.model, pile.states(), {.longest_s = 0.2});
  finish(rest);
  EXPECT_FALSE(rest.is_at_rest());
  EXPECT_NEAR(rest.time_s(), 0.2, 0.02);
  EXPECT_EQ(rest.states().flags[1] & kAsleep, 0);
}

// Like a body pinched by two others: points do not resist rotation about their line.
TEST(FinishRest, ASwingingBodyThatNothingStopsComesToRest) {
  Pile pile;
  pile.add({0.5, 2, 0});
  pile.model.bodies.back().hinge = {.axis = Vec3::UnitZ(), .anchor = Vec3(0, 2, 0)};
  ExactRest rest(pile.scene, pile.model, pile.states());
  finish(rest);
  EXPECT_TRUE(rest.is_at_rest());
  EXPECT_NEAR(rest.states().position[1].x(), 0, 0.02);
  EXPECT_NEAR(rest.states().position[1].y(), 1.5, 0.01);
}

// Long paths are recorded: a body that fell from a table is not drawn through it.
TEST(FinishRest, WaysOfWhatGoesFarAreKept) {
  Pile pile;
  pile.add({0, 1, 0});
  ExactRest rest(pile.scene, pile.model, pile.states());
  finish(rest);
  const std::vector<WayPoint> ways = rest.take_ways();
  ASSERT_GT(ways.size(), 2U);
  for (size_t i = 1; i < ways.size(); ++i) {
    EXPECT_LT(ways[i].position.y(), ways[i - 1].position.y());
  }
}

// Overlaps leave from the ends inwards: more bodies take longer.
TEST(FinishRest, PartsForAsLongAsItHelps) {
  const Pile pile = sunk_pile(4, 20);
  ExactRest rest(pile.scene, pile.model, pile.states());
  while (rest.time_s() == 0) rest.step();
  const PileQuality parted = inspect_pile(pile.model, pile.scene.gravity, rest.states());
  EXPECT_LT(parted.deepest_penetration_m, 0.02 * parted.body_diameter_m);
}

TEST(FinishRest, DoesNotDependOnThreads) {
  const Pile pile = sunk_pile(5, 5);
  const int threads = thread_count();
  std::vector<BodyStates> ends;
  for (const int count : {1, 2}) {
    set_thread_count(count);
    ExactRest rest(pile.scene, pile.model, pile.states(), {.longest_s = 1});
    finish(rest);
    ends.push_back(rest.states());
  }
  set_thread_count(threads);
  EXPECT_EQ(ends[0].position, ends[1].position);
}

// Icosahedra, which almost fill their bounding spheres, in a block with this spacing.
Pile block_of_balls(double spacing_m) {
  Pile pile;
  const double golden = (1 + std::sqrt(5.0)) / 2;
  std::vector<Vec3> corners;
  for (const double x : {-1.0, 1.0}) {
    for (const double y : {-golden, golden}) {
      for (int turn = 0; turn < 3; ++turn) {
        Vec3 corner = Vec3::Zero();
        corner[turn] = x;
        corner[(turn + 1) % 3] = y;
        corners.emplace_back(kSide / 2 * corner.normalized());
      }
    }
  }
  pile.crate = pile.hull(corners);
  for (int y = 0; y < 7; ++y) {
    for (int x = -5; x <= 5; ++x) {
      for (int z = -5; z <= 5; ++z) {
        pile.add(Vec3(x, y, z) * spacing_m + Vec3(0.003 * y, kSide / 2, 0.005 * x));
      }
    }
  }
  return pile;
}

// Stopped while bodies separate, and while they settle.
void expect_the_same_bits(const Pile& pile, const RestSettings& settings) {
  ExactRest whole(pile.scene, pile.model, pile.states(), settings);
  int parting = 0, all = 0;  // steps
  while (!whole.is_over()) {
    whole.step();
    ++all;
    if (whole.time_s() == 0) parting = all;
  }
  const std::vector<WayPoint> ways = whole.take_ways();
  for (const int stop : {parting / 2, (parting + all) / 2}) {
    ExactRest first(pile.scene, pile.model, pile.states(), settings);
    for (int i = 0; i < stop; ++i) first.step();
    EXPECT_EQ(first.time_s() > 0, stop > parting);
    StateWriter writer;
    first.save(writer);
    ExactRest second(pile.scene, pile.model, pile.states(), settings);
    StateReader reader(writer.bytes());
    second.load(reader);
    EXPECT_EQ(reader.left(), 0U);
    EXPECT_EQ(second.time_s(), first.time_s());
    finish(second);
    EXPECT_EQ(second.states().position, whole.states().position) << stop;
    EXPECT_EQ(second.states().flags, whole.states().flags) << stop;
    EXPECT_EQ(second.left(), whole.left()) << stop;
    EXPECT_EQ(second.take_ways().size(), ways.size()) << stop;
    StateReader cut(writer.bytes().first(writer.bytes().size() / 2));
    ExactRest third(pile.scene, pile.model, pile.states(), settings);
    EXPECT_THROW(third.load(cut), Error);
  }
}

TEST(FinishRest, GoesOnFromWhatWasSavedWithTheSameBits) {
  expect_the_same_bits(sunk_pile(3, 3), {});
  expect_the_same_bits(block_of_balls(0.66 * kSide), {.visible_only = true});
}

// Deep bodies are left as they are, and at most give way to bodies that must become sound but
// cannot get out of them. Then they need not become sound themselves, unless they come into view.
TEST(FinishRest, HiddenBodiesAreLeft) {
  size_t left_at_first = 0, left_at_last = 0;
  for (const double spacing_m : {0.6 * kSide, 0.66 * kSide}) {
    const bool gives_way = spacing_m > 0.63 * kSide;
    const Pile pile = block_of_balls(spacing_m);
    const BodyStates start = pile.states();
    ExactRest rest(pile.scene, pile.model, start, {.visible_only = true});
    const std::vector<uint32_t> left = rest.left();
    ASSERT_GT(left.size(), 10U);
    EXPECT_EQ(left.size() + rest.movable() + 1, start.size());
    finish(rest);
    const std::vector<uint32_t> left_then = rest.left();
    EXPECT_TRUE(std::ranges::includes(left, left_then));
    EXPECT_GT(left_then.size(), 10U);
    left_at_first += left.size();
    left_at_last += left_then.size();
    BodyStates finished = rest.states();
    const std::vector<double> depths = depths_under_surface(pile.model, finished);
    size_t moved = 0;
    for (const uint32_t body : left_then) {
      if (finished.position[body] != start.position[body]) ++moved;
      EXPECT_GT(depths[body], 0.7 * kSide) << body << " may be seen";
      EXPECT_NE(finished.flags[body] & kAsleep, 0) << body;
    }
    // Judge them like the ground.
    for (const uint32_t body : left_then) finished.flags[body] |= kHeld;
    EXPECT_TRUE(moved > 0 || !gives_way);
    const PileQuality after = inspect_pile(pile.model, pile.scene.gravity, finished);
    EXPECT_LT(after.deepest_penetration_m, 0.02 * after.body_diameter_m);
    EXPECT_LE(after.unsettled, 1U);
    EXPECT_EQ(after.floating, 0U);
    // At the surface, all bodies have separated from the others.
    ExactRest whole(pile.scene, pile.model, start);
    EXPECT_TRUE(whole.left().empty());
  }
  // How many give way in one pile is chance.
  EXPECT_GT(left_at_last, left_at_first / 3);
}

TEST(FinishRest, UndoesOverlapsWhereNothingFalls) {
  Pile pile;
  pile.scene.gravity.setZero();
  pile.add({0, 5, 0});
  pile.add({0.1, 5, 0});
  ExactRest rest(pile.scene, pile.model, pile.states());
  finish(rest);
  EXPECT_TRUE(rest.is_at_rest());
  const double apart = rest.states().position[2].x() - rest.states().position[1].x();
  EXPECT_GT(apart, 0.98 * kSide);
  EXPECT_LT(apart, 1.01 * kSide) << "and no farther: they keep no speed";
}

}  // namespace
}  // namespace pilesim
