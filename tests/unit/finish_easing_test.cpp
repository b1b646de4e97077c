// Eased corrections of a trajectory.

#include <gtest/gtest.h>

#include <cmath>

#include "finish/easing.h"
#include "support/small_model.h"

namespace pilesim {
namespace {

constexpr double kRate = 60;  // frames per second
constexpr uint64_t kFrames = 180;
constexpr uint64_t kLands = 60, kStops = 120;

// A ball that flies for a second, rolls to a halt during another one, and rests.
Vec3 place(uint64_t frame) {
  const auto at = static_cast<double>(std::min(frame, kStops)) / kRate;
  if (frame <= kLands) return {at, 10 - 9.81 / 2 * at * at, 0};
  const double rolled = at - 1;
  return {1 + rolled - rolled * rolled / 2, 10 - 9.81 / 2, 0};
}

TrajectoryFrame frame_at(uint64_t frame) {
  return {.position = {place(frame)}, .orientation = {Quatf::Identity()}, .state = {kPresent}};
}

struct Easing : testing::Test {
  Easing() {
    model.body(model.sphere(0.1), model.material(0, 0.5), place(0));
    RestStretches found(model.model, {0, -9.81, 0}, kRate, frame_at(kFrames - 1), kFrames);
    for (uint64_t i = 0; i < kFrames; ++i) found.take(frame_at(i));
    stretches = found.stretches();
  }
  EasedFrames eased(std::vector<WayPoint> ways = {}) const {
    BodyStates to;
    to.position = {end};
    to.orientation = {Quat(Eigen::AngleAxisd(1, Vec3::UnitX()))};
    to.flags = {kPresent};
    return {stretches, frame_at(kFrames - 1), to, std::move(ways)};
  }
  static TrajectoryFrame at(const EasedFrames& eased, uint64_t index) {
    TrajectoryFrame frame = frame_at(index);
    eased.ease(index, frame);
    return frame;
  }

  SmallModel model;
  std::vector<RestStretches::Stretch> stretches;
  Vec3 end = place(kFrames - 1) + Vec3(0, 0.05, 0.02);
};

TEST_F(Easing, ABodyComesToRestFromItsFirstContactOn) {
  EXPECT_NEAR(stretches[0].first, kLands, 1);
  EXPECT_NEAR(stretches[0].last, kStops, 12);  // the last hundredths of the radius take a while
}

TEST_F(Easing, InFlightItIsTheTrajectoryAndAtTheEndTheCorrection) {
  const EasedFrames eased = this->eased();
  for (uint64_t i = 0; i < kLands; ++i) {
    EXPECT_EQ(at(eased, i).position[0], frame_at(i).position[0]) << i;
    EXPECT_EQ(at(eased, i).orientation[0].coeffs(), frame_at(i).orientation[0].coeffs()) << i;
  }
  for (uint64_t i = kStops; i < kFrames; ++i) {
    EXPECT_LT((at(eased, i).position[0] - end).norm(), 1e-5) << i;
  }
  EXPECT_NEAR(at(eased, kFrames - 1)
                  .orientation[0]
                  .angularDistance(Quatf(Eigen::AngleAxisf(1, Vec3f::UnitX()))),
              0, 1e-4);
}

TEST_F(Easing, NothingJumpsAndTheLargestExtraSpeedIsStated) {
  const EasedFrames eased = this->eased();
  double largest = 0;
  Vec3 extra = Vec3::Zero();
  std::vector<double> steps;
  for (uint64_t i = 0; i < kFrames; ++i) {
    const Vec3 now = at(eased, i).position[0] - place(i);
    steps.push_back((now - extra).norm() * kRate);
    largest = std::max(largest, steps.back());
    extra = now;
  }
  EXPECT_LE(largest, eased.largest_extra_speed(kRate) * 1.001);
  EXPECT_GE(largest, eased.largest_extra_speed(kRate) * 0.95);
  // Zero slope at both ends.
  EXPECT_LT(steps[kLands + 1], largest / 10);
  EXPECT_LT(steps[static_cast<size_t>(stretches[0].last)], largest / 10);
}

// The corrections follow a detour around an obstacle.
TEST_F(Easing, FollowsTheWayOfTheExactEngine) {
  const Vec3 aside = place(kFrames - 1) + Vec3(0, 0.05, 0.5);
  const EasedFrames eased = this->eased({{0, aside, Quatf::Identity()}});
  double nearest = 1;
  for (uint64_t i = kLands; i < kFrames; ++i) {
    const Vec3 offset = at(eased, i).position[0] - place(i);
    nearest = std::min(nearest, (offset - Vec3(0, 0.05, 0.5)).norm());
  }
  EXPECT_LT(nearest, 0.05);
}

// A body that stops at once still gets its time.
TEST(EasingStretches, AreNotShort) {
  SmallModel model;
  model.body(model.sphere(0.1), model.material(0, 0.5), {0, 0.1, 0});
  const TrajectoryFrame lies{
      .position = {{0, 0.1, 0}}, .orientation = {Quatf::Identity()}, .state = {kPresent}};
  RestStretches found(model.model, {0, -9.81, 0}, kRate, lies, kFrames);
  for (uint64_t i = 0; i < kFrames; ++i) found.take(lies);
  const auto stretch = found.stretches()[0];
  EXPECT_LE(stretch.first, 3);
  EXPECT_NEAR(stretch.last - stretch.first, 3 * std::sqrt(0.2 / 9.81) * kRate, 1);
}

}  // namespace
}  // namespace pilesim
