// Eases a simulated trajectory to a new end: each body's correction grows smoothly while the body
// comes to rest, so that nothing jumps.
#pragma once

#include <vector>

#include "core/types.h"
#include "finish/exact_rest.h"
#include "simulate/body_state.h"
#include "trajectory/trajectory.h"

namespace pilesim {

// For each body the frames in which it comes to rest: from its first contact to its arrival.
class RestStretches {
 public:
  // `end` is the last of `frames` frames. `model` must outlive it.
  RestStretches(const Model& model, const Vec3& gravity, double frame_rate, TrajectoryFrame end,
                uint64_t frames);
  // Call it with all frames, in order.
  void take(const TrajectoryFrame& frame);

  struct Stretch {
    double first = 0, last = 0;  // frames; first <= last
  };
  // Call it after the last frame. No stretch is shorter than the time a body takes to fall over: if
  // a body comes to rest sooner, its stretch starts before the contact or ends after the arrival,
  // within the trajectory.
  std::vector<Stretch> stretches() const;

 private:
  const Model& model_;
  Vec3 fall_;     // m: displacement by gravity per frame
  double least_;  // shortest stretch, frames
  TrajectoryFrame end_;
  uint64_t frames_;
  uint64_t taken_ = 0;
  TrajectoryFrame before_, before_that_;
  std::vector<uint32_t> present_from_, contact_, moved_;  // (B) frames
};

// Adds the corrections to bodies along their paths.
class EasedFrames {
 public:
  // From `from`, the last frame of the trajectory, to `to`, along `ways`.
  EasedFrames(std::vector<RestStretches::Stretch> stretches, const TrajectoryFrame& from,
              const BodyStates& to, std::vector<WayPoint> ways);

  // Corrects frame `index`.
  void ease(uint64_t index, TrajectoryFrame& frame) const;
  // Largest speed, m/s, that the corrections add to a centre, over all bodies and frames.
  double largest_extra_speed(double frame_rate) const;

 private:
  struct Way {
    uint32_t body;
    uint32_t first, count;  // in points_: the start, points between, the end
    double length_m;
  };
  struct Point {
    Vec3 offset;  // m, relative to the trajectory's end
    Quat turn;    // applied after the orientation there
    double at_m;  // distance along the path
  };
  std::vector<RestStretches::Stretch> stretches_;
  std::vector<Way> ways_;  // of the bodies that move
  std::vector<Point> points_;
};

}  // namespace pilesim
