// The way from a simulated trajectory to another end: each body's correction is eased in while the
// body comes to rest, so that nothing jumps.
#pragma once

#include <vector>

#include "core/types.h"
#include "finish/exact_rest.h"
#include "simulate/body_state.h"
#include "trajectory/trajectory.h"

namespace pilesim {

// For each body the frames in which it comes to rest: from its first contact to where it ends.
class RestStretches {
 public:
  // `end`: the last frame, which is `frames` - 1. `model` must outlive it.
  RestStretches(const Model& model, const Vec3& gravity, double frame_rate, TrajectoryFrame end,
                uint64_t frames);
  // All frames, in order.
  void take(const TrajectoryFrame& frame);

  struct Stretch {
    double first = 0, last = 0;  // frames; first <= last
  };
  // When all are taken. Nothing is eased in less time than a body takes to fall over: a body that
  // comes to rest sooner begins a little before it touches or ends a little after, within the
  // trajectory.
  std::vector<Stretch> stretches() const;

 private:
  const Model& model_;
  Vec3 fall_;     // m: what gravity adds to the way from one frame to the next
  double least_;  // frames
  TrajectoryFrame end_;
  uint64_t frames_;
  uint64_t taken_ = 0;
  TrajectoryFrame before_, before_that_;
  std::vector<uint32_t> present_from_, contact_, moved_;  // (B) frames
};

// The corrections that are added to bodies along their ways.
class EasedFrames {
 public:
  // From `from`, the last frame of the trajectory, to `to`, along `ways`.
  EasedFrames(std::vector<RestStretches::Stretch> stretches, const TrajectoryFrame& from,
              const BodyStates& to, std::vector<WayPoint> ways);

  // Changes the frame with that number.
  void ease(uint64_t index, TrajectoryFrame& frame) const;
  // m/s, over all bodies and frames: the largest that is added to the speed of a centre.
  double largest_extra_speed(double frame_rate) const;

 private:
  struct Way {
    uint32_t body;
    uint32_t first, count;  // in points_: the beginning, points between, the end
    double length_m;
  };
  struct Point {
    Vec3 offset;  // m, from where the trajectory ends
    Quat turn;    // after the orientation there
    double at_m;  // along the way
  };
  std::vector<RestStretches::Stretch> stretches_;
  std::vector<Way> ways_;  // of the bodies that are moved
  std::vector<Point> points_;
};

}  // namespace pilesim
