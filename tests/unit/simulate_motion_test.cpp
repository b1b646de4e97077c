// Motion keys: whole turns, smooth motion, and velocities that match the poses.
#include <gtest/gtest.h>

#include <cmath>

#include "core/rotation.h"
#include "model/kinematic_motion.h"

namespace pilesim {
namespace {

MotionKey turned(double time_s, const Vec3& rotation_deg, const Vec3& position = Vec3::Zero()) {
  return {time_s, {position, from_rotation_deg(rotation_deg)}, rotation_deg};
}

MotionKey at(double time_s, const Vec3& position, const Quat& orientation = Quat::Identity()) {
  return {time_s, {position, orientation}, {}};
}

Pose pose(const Motion& motion, double time_s) { return pose_at(ModelShape(), motion, time_s); }

constexpr double kDifference = 1e-5;  // s

Vec3 velocity(const Motion& motion, double time_s) {
  return (pose(motion, time_s + kDifference).position -
          pose(motion, time_s - kDifference).position) /
         (2 * kDifference);
}

Vec3 spin(const Motion& motion, double time_s) {
  return turn_between(pose(motion, time_s - kDifference).orientation,
                      pose(motion, time_s + kDifference).orientation) /
         (2 * kDifference);
}

TEST(KeyedMotion, TurnsAsOftenAsTheAnglesSay) {
  for (const double turns : {0.25, 0.75, 1.0, 2.5, -3.0}) {
    for (int axis = 0; axis < 3; ++axis) {
      const Motion motion = {turned(1, Vec3::Zero()), turned(3, 360 * turns * Vec3::Unit(axis))};
      for (const double share : {0.1, 0.5, 0.9}) {
        EXPECT_LT((spin(motion, 1 + 2 * share) - kPi * turns * Vec3::Unit(axis)).norm(), 1e-6);
        const Quat wanted(Eigen::AngleAxisd(2 * kPi * turns * share, Vec3::Unit(axis)));
        EXPECT_LT(pose(motion, 1 + 2 * share).orientation.angularDistance(wanted), 1e-7);
      }
    }
  }
}

TEST(KeyedMotion, OrientationsTakeTheShortestWay) {
  const Quat most(Eigen::AngleAxisd(1.5 * kPi, Vec3::UnitY()));
  const Motion motion = {at(0, Vec3::Zero()), at(1, Vec3::Zero(), most)};
  EXPECT_LT((spin(motion, 0.5) + kPi / 2 * Vec3::UnitY()).norm(), 1e-6);
}

TEST(KeyedMotion, SmoothStartsAndEndsAtRest) {
  Motion motion = {turned(0, {0, 0, 0}), turned(2, {0, 720, 0}, {4, 0, -2})};
  motion.interpolation = Interpolation::smooth;
  for (const double share : {0.25, 0.5, 0.8}) {
    // x = 3 s^2 - 2 s^3, so that its rate is 6 s (1 - s).
    const double done = share * share * (3 - 2 * share), rate = 6 * share * (1 - share) / 2;
    const double time_s = 2 * share;
    EXPECT_LT((pose(motion, time_s).position - done * Vec3(4, 0, -2)).norm(), 1e-12);
    EXPECT_LT((velocity(motion, time_s) - rate * Vec3(4, 0, -2)).norm(), 1e-6);
    EXPECT_LT((spin(motion, time_s) - rate * 4 * kPi * Vec3::UnitY()).norm(), 1e-5);
  }
  EXPECT_LT(velocity(motion, kDifference).norm(), 1e-3);
  EXPECT_LT(velocity(motion, 2 - kDifference).norm(), 1e-3);
  EXPECT_EQ(pose(motion, 5).position, Vec3(4, 0, -2));
}

TEST(KeyedMotion, SmoothPassesKeysWithoutJerkAndNeverOvershoots) {
  const Quat first(Eigen::AngleAxisd(0.7, Vec3(1, 2, 0).normalized()));
  const Quat second = Quat(Eigen::AngleAxisd(1.1, Vec3(0, 1, 3).normalized())) * first;
  Motion motion = {at(0, {0, 0, 0}), at(1, {1, 0, 0}, first), at(3, {4, 1, 0}, second),
                   at(4, {4, 0, 0}, second)};
  motion.interpolation = Interpolation::smooth;
  for (const double key_s : {1.0, 3.0}) {
    const double near = 1e-4;
    EXPECT_LT((velocity(motion, key_s + near) - velocity(motion, key_s - near)).norm(), 2e-3);
    EXPECT_LT((spin(motion, key_s + near) - spin(motion, key_s - near)).norm(), 2e-3);
  }
  EXPECT_GT(velocity(motion, 1).x(), 0.5);
  EXPECT_GT(spin(motion, 1).norm(), 0.1);
  for (double time_s = 3; time_s <= 4; time_s += 0.01) {
    EXPECT_NEAR(pose(motion, time_s).position.x(), 4, 1e-12);
  }
  for (const MotionKey& key : motion) {
    EXPECT_LT((pose(motion, key.time_s).position - key.pose.position).norm(), 1e-12);
    EXPECT_LT(pose(motion, key.time_s).orientation.angularDistance(key.pose.orientation), 1e-7);
  }
}

}  // namespace
}  // namespace pilesim
