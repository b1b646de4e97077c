// Levels by importance within a budget of modelled time or error.

#include "simulate/mixed/detail_budget.h"

#include <gtest/gtest.h>

#include <numeric>

#include "simulate/mixed/mixed_constants.h"

namespace pilesim {
namespace {

// Twenty balls in a row away from the camera; no must-impulse body.
class Budget : public testing::Test {
 protected:
  static constexpr uint32_t kCount = 20;

  Budget() {
    scene_.step_s = 1 / scene_.frame_rate;  // one step a frame
    scene_.shapes["ball"] = SphereShape{0.1};
    scene_.materials["m"] = {};
    Emitter row{.name = "row", .shapes = {"ball"}, .material = "m"};
    row.source = GridSource{{0, 0, -10}, {1, 1, kCount}, {1, 1, 1}};
    scene_.emitters = {row};
    scene_.camera.keys = {{.position = {0, 0, 3}, .target = {0, 0, 0}}};
    scene_.simulator.detail.levels = {
        {.near_near = PairMethod::impulse, .exact = true}, {}, LevelOfDetail::table_4_1()[2]};
    model_ = build_model(scene_);
    for (const ModelBody& body : model_.bodies) {
      states_.position.push_back(body.pose.position);
      states_.linear_velocity.push_back(Vec3::Zero());
      states_.flags.push_back(kPresent | kStatistical);
    }
    bodies_.resize(kCount);
    std::iota(bodies_.begin(), bodies_.end(), 0U);
    levels_.assign(kCount, 2);
  }
  // How many bodies have each level.
  std::vector<int> choose() {
    DetailBudget budget(scene_, model_, [](const Vec3&) { return 1e9; });
    budget.choose(
        Viewpoint(scene_.camera.keys[0], 1.5), states_, bodies_,
        [](uint32_t) { return Behaviour::statistical; }, fixed_, 2, levels_);
    modelled_ms_ = budget.modelled_ms();
    modelled_error_ = budget.modelled_error();
    std::vector<int> counts(3);
    for (const uint8_t level : levels_) ++counts[level];
    return counts;
  }
  Scene scene_;
  Model model_;
  BodyStates states_;
  std::vector<uint32_t> bodies_;
  std::vector<uint8_t> levels_;
  StepWork fixed_;
  double modelled_ms_ = 0, modelled_error_ = 0;
};

TEST_F(Budget, MoreTimeMakesMoreBodiesFiner) {
  int finest_before = -1;
  for (const double ms : {0.001, 0.017, 0.05, 0.1, 0.3, 1.0}) {
    scene_.simulator.budget_ms_per_frame = ms;
    levels_.assign(kCount, 2);
    const std::vector<int> counts = choose();
    EXPECT_GE(counts[0], finest_before);
    finest_before = counts[0];
    // Less than particles cost is not to be had.
    EXPECT_LE(
        modelled_ms_,
        std::max(ms, 1e-3 * kCount *
                         cost_us(usual_work(model_.shapes[0], false, PairMethod::particle, 2))) +
            1e-12);
  }
  EXPECT_EQ(finest_before, static_cast<int>(kCount));
}

TEST_F(Budget, IsSharedByTheStepsOfAFrameAndByWhatMustBeSolved) {
  scene_.simulator.budget_ms_per_frame = 1;
  levels_.assign(kCount, 2);
  const int alone = choose()[0];
  fixed_ = {.pieces = 950 / cost_us({.pieces = 1})};
  levels_.assign(kCount, 2);
  EXPECT_LT(choose()[0], alone);
  EXPECT_NEAR(modelled_ms_, 1, 0.2);
  fixed_ = {};
  scene_.step_s = scene_.actual_step_s() / 8;
  scene_.simulator.budget_ms_per_frame = 8;
  levels_.assign(kCount, 2);
  EXPECT_EQ(choose()[0], alone);
  EXPECT_LE(modelled_ms_, 8);
}

TEST_F(Budget, WhatIsNearTheCameraComesFirst) {
  scene_.simulator.budget_ms_per_frame = 0.1;
  choose();
  EXPECT_EQ(levels_.back(), 0);
  EXPECT_GT(levels_.front(), 0);
  states_.linear_velocity.front() = {0, 0, 1};
  states_.position.front() = {0, 0, 1};
  choose();
  EXPECT_EQ(levels_.front(), 0);
}

TEST_F(Budget, SleepersCostNothingAndKeepTheirLevel) {
  scene_.simulator.budget_ms_per_frame = 1;
  for (uint8_t& flags : states_.flags) flags |= kAsleep;
  levels_.assign(kCount, 1);
  EXPECT_EQ(choose(), (std::vector<int>{0, static_cast<int>(kCount), 0}));
  EXPECT_EQ(modelled_ms_, 0);
}

TEST_F(Budget, TheErrorStaysBelowTheLimitAtTheLeastRefinement) {
  scene_.simulator.max_error = 2;
  std::vector<int> counts = choose();
  EXPECT_LE(modelled_error_, 2);
  EXPECT_GT(counts[2], 0);
  scene_.simulator.max_error = 1;
  levels_.assign(kCount, 2);
  counts = choose();
  EXPECT_EQ(counts[0], static_cast<int>(kCount));
  scene_.simulator.max_error = 3;
  levels_.assign(kCount, 2);
  counts = choose();
  EXPECT_EQ(counts[2], static_cast<int>(kCount));
}

}  // namespace
}  // namespace pilesim
