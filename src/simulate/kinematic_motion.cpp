#include "simulate/kinematic_motion.h"

#include <algorithm>

namespace pilesim {
namespace {

// Of the shape's own frame.
Pose key_pose(const std::vector<MotionKey>& keys, double time_s) {
  const auto after = std::ranges::upper_bound(keys, time_s, {}, &MotionKey::time_s);
  if (after == keys.begin()) return keys.front().pose;
  if (after == keys.end()) return keys.back().pose;
  const MotionKey& a = *std::prev(after);
  const double share = (time_s - a.time_s) / (after->time_s - a.time_s);
  return {a.pose.position + share * (after->pose.position - a.pose.position),
          a.pose.orientation.slerp(share, after->pose.orientation)};
}

}  // namespace

Pose pose_at(const ModelShape& shape, const std::vector<MotionKey>& keys, double time_s) {
  const Pose pose = key_pose(keys, time_s);
  return {pose.apply(shape.origin_offset), pose.orientation};
}

Vec3 turn_between(const Quat& from, const Quat& to) {
  const Eigen::AngleAxisd turn(to * from.conjugate());
  const double angle = turn.angle() > kPi ? turn.angle() - 2 * kPi : turn.angle();
  return angle * turn.axis();
}

}  // namespace pilesim
