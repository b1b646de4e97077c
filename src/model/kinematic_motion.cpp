#include "model/kinematic_motion.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <variant>

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

// The pose of the shape's own frame.
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

// How much of a motor there is, and of that the integral over time.
class Envelope {
 public:
  Envelope(const Motor& motor, double time_s)
      : ramp_s_(motor.ramp_s),
        after_s_(time_s - motor.start_s),
        length_s_(motor.end_s.value_or(std::numeric_limits<double>::infinity()) - motor.start_s) {}

  double share() const {
    if (after_s_ < 0 || after_s_ > length_s_) return 0;
    return grown(after_s_) * grown(length_s_ - after_s_);
  }
  double integral_s() const {
    const double whole = std::clamp(after_s_, ramp_s_, std::max(ramp_s_, length_s_ - ramp_s_));
    return ramp_s_ * grown_sum(after_s_) + whole - ramp_s_ +
           ramp_s_ * (0.5 - grown_sum(length_s_ - after_s_));
  }

 private:
  // A ramp from 0 to 1 without jerks, `s` seconds after its begin; the integral, in its length.
  double part(double s) const { return std::clamp(s / ramp_s_, 0.0, 1.0); }
  double grown(double s) const {
    if (ramp_s_ == 0) return 1;
    return part(s) * part(s) * (3 - 2 * part(s));
  }
  double grown_sum(double s) const {
    if (ramp_s_ == 0) return 0.5;
    const double p = part(s);
    return p * p * p * (1 - p / 2);
  }

  double ramp_s_, after_s_, length_s_;
};

Pose turn_about(const Vec3& anchor, const Vec3& turn) {
  const Quat turned = turned_by(turn);
  return {anchor - turned * anchor, turned};
}

// The own frame as a motor has moved it, in that frame as it was.
Pose moved_by(const Motor& motor, double time_s) {
  const Envelope envelope(motor, time_s);
  if (const auto* spin = std::get_if<SpinMotor>(&motor.action)) {
    return turn_about(spin->anchor, envelope.integral_s() * spin->angular_velocity);
  }
  const double angle = 2 * kPi * motor.frequency_hz * (time_s - motor.start_s) + motor.phase;
  const double wave = envelope.share() * std::sin(angle);
  if (const auto* sway = std::get_if<SwayMotor>(&motor.action)) {
    return turn_about(sway->anchor, wave * sway->amplitude * sway->axis);
  }
  return {wave * std::get<ShakeMotor>(motor.action).amplitude_m, Quat::Identity()};
}

}  // namespace

Pose pose_at(const Motion& motion, double time_s) {
  Pose pose = key_pose(motion, time_s);
  for (const Motor& motor : motion.motors) {
    const Pose moved = moved_by(motor, time_s);
    pose = {pose.apply(moved.position), (pose.orientation * moved.orientation).normalized()};
  }
  return pose;
}

Pose pose_at(const ModelShape& shape, const Motion& motion, double time_s) {
  const Pose pose = pose_at(motion, time_s);
  return {pose.apply(shape.origin_offset), pose.orientation};
}

double most_acceleration_m_s2(const ModelShape& shape, const Motion& motion) {
  double sum = 0;
  for (const Motor& motor : motion.motors) {
    // In a ramp the share grows by up to 1.5 per_s, and that changes by up to 6 per_s^2.
    const double rate = 2 * kPi * motor.frequency_hz;
    const double per_s = motor.ramp_s > 0 ? 1 / motor.ramp_s : 0;
    const double of_wave = rate * rate + 3 * rate * per_s + 6 * per_s * per_s;
    const auto reach_m = [&](const Vec3& anchor) {
      return (shape.origin_offset - anchor).norm() + shape.bounding_radius;
    };
    if (const auto* spin = std::get_if<SpinMotor>(&motor.action)) {
      const double speed = spin->angular_velocity.norm();
      sum += speed * (speed + 1.5 * per_s) * reach_m(spin->anchor);
    } else if (const auto* sway = std::get_if<SwayMotor>(&motor.action)) {
      const double most = sway->amplitude * of_wave;  // at the ends; in the middle it turns
      sum += std::max(most, most * sway->amplitude) * reach_m(sway->anchor);
    } else {
      sum += std::get<ShakeMotor>(motor.action).amplitude_m.norm() * of_wave;
    }
  }
  return sum;
}

Vec3 turn_between(const Quat& from, const Quat& to) {
  const Eigen::AngleAxisd turn(to * from.conjugate());
  const double angle = turn.angle() > kPi ? turn.angle() - 2 * kPi : turn.angle();
  return angle * turn.axis();
}

}  // namespace pilesim
