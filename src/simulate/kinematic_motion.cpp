#include "simulate/kinematic_motion.h"

#include <algorithm>
#include <functional>

#include "core/rotation.h"

namespace pilesim {
namespace {

// Values at keys and how they change: per second of the time from key to key.
class Curve {
 public:
  // step(i): by how much the value changes from key i to the next.
  Curve(const Motion& motion, std::function<Vec3(size_t)> step)
      : motion_(motion), step_(std::move(step)) {}

  double seconds(size_t key) const { return motion_[key + 1].time_s - motion_[key].time_s; }

  // The rate at a key: 0 at both ends and where the value turns back.
  Vec3 rate(size_t key) const {
    if (key == 0 || key + 1 == motion_.size()) return Vec3::Zero();
    const double before_s = seconds(key - 1), after_s = seconds(key);
    const Vec3 before = step_(key - 1) / before_s, after = step_(key) / after_s;
    const double of_before = 2 * after_s + before_s, of_after = after_s + 2 * before_s;
    Vec3 rate = Vec3::Zero();
    for (int k = 0; k < 3; ++k) {
      if (before[k] * after[k] <= 0) continue;
      rate[k] = (of_before + of_after) / (of_before / before[k] + of_after / after[k]);
    }
    return rate;
  }

  // How much of the step from a key has been done after a share of its time.
  Vec3 done(size_t key, double share) const {
    const Vec3 step = step_(key);
    if (motion_.interpolation == Interpolation::linear) return share * step;
    const double square = share * share, cube = square * share;
    return (3 * square - 2 * cube) * step +
           seconds(key) *
               ((cube - 2 * square + share) * rate(key) + (cube - square) * rate(key + 1));
  }

 private:
  const Motion& motion_;
  std::function<Vec3(size_t)> step_;
};

Quat turned_by(const Vec3& turn) {
  const double angle = turn.norm();
  return angle > 0 ? Quat(Eigen::AngleAxisd(angle, turn / angle)) : Quat::Identity();
}

Quat orientation_at(const Motion& motion, size_t key, double share) {
  const bool counts_turns = std::ranges::all_of(
      motion, [](const MotionKey& each) { return each.rotation_deg.has_value(); });
  if (counts_turns) {
    const Curve angles(motion, [&](size_t i) {
      return Vec3(*motion[i + 1].rotation_deg - *motion[i].rotation_deg);
    });
    return from_rotation_deg(*motion[key].rotation_deg + angles.done(key, share));
  }
  const Quat from = motion[key].pose.orientation, to = motion[key + 1].pose.orientation;
  if (motion.interpolation == Interpolation::linear) return from.slerp(share, to);
  const Curve turns(motion, [&](size_t i) {
    return turn_between(motion[i].pose.orientation, motion[i + 1].pose.orientation);
  });
  const double third_s = turns.seconds(key) / 3;
  const Quat leaving = turned_by(third_s * turns.rate(key)) * from;
  const Quat arriving = turned_by(-third_s * turns.rate(key + 1)) * to;
  const Quat first = from.slerp(share, leaving), middle = leaving.slerp(share, arriving),
             last = arriving.slerp(share, to);
  return first.slerp(share, middle).slerp(share, middle.slerp(share, last));
}

// Of the shape's own frame.
Pose key_pose(const Motion& motion, double time_s) {
  const auto after = std::ranges::upper_bound(motion, time_s, {}, &MotionKey::time_s);
  if (after == motion.begin()) return motion.front().pose;
  if (after == motion.end()) return motion.back().pose;
  const auto key = static_cast<size_t>(after - motion.begin()) - 1;
  const Curve places(motion, [&](size_t i) {
    return Vec3(motion[i + 1].pose.position - motion[i].pose.position);
  });
  const double share = (time_s - motion[key].time_s) / places.seconds(key);
  return {motion[key].pose.position + places.done(key, share), orientation_at(motion, key, share)};
}

}  // namespace

Pose pose_at(const ModelShape& shape, const Motion& motion, double time_s) {
  const Pose pose = key_pose(motion, time_s);
  return {pose.apply(shape.origin_offset), pose.orientation};
}

Vec3 turn_between(const Quat& from, const Quat& to) {
  const Eigen::AngleAxisd turn(to * from.conjugate());
  const double angle = turn.angle() > kPi ? turn.angle() - 2 * kPi : turn.angle();
  return angle * turn.axis();
}

}  // namespace pilesim
