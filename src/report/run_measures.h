// Measures of a trajectory for comparisons: distributions over bodies and some figures of the
// whole, in units of body size and gravity. They use trajectories only, so velocities are
// differences of consecutive frames: motion within a frame is invisible, and rotations beyond half
// a turn per frame are underestimated.
#pragma once

#include <string>
#include <vector>

#include "core/types.h"
#include "trajectory/trajectory.h"

namespace pilesim {

// Units derive from D, the mean diameter of the dynamic bodies (of the mesh's bounding sphere about
// the centre of mass), and T = sqrt(D / g); without gravity T is 1 s.
struct MeasuredQuantity {
  std::string name;  // "radial_distance"
  std::string unit;  // "D"
  // (times) samples, ascending: one per body, or a single one for a figure of the whole.
  std::vector<std::vector<double>> samples;
};

struct RunMeasures {
  double diameter_m = 0;
  double unit_time_s = 0;                    // T
  std::vector<double> times_s;               // moments of the distributions in time
  std::vector<MeasuredQuantity> quantities;  // equal in names and order for every run
  double mean_bodies = 0;  // dynamic and present, averaged over the frames after the first
  uint64_t bodies_at_end = 0;
};

// Distributions over the dynamic bodies present, at `times` moments spread evenly up to the end:
//   radial_distance, height   D; about the mean horizontal position of all starts
//   speed, spin               D/T, 1/T
//   energy                    (D/T)^2 per unit of mass, every frame: kinetic, by the differences,
//                             and potential above the world's origin; equal density for all bodies
//   settling_time             T; when a body's centre or rim last moved faster than 0.05 D/T
//   tilt                      degrees, at the end: between the body's up and that of its nearest
//                             rest pose on a plane with a probability of at least 5 %
//   pile_angle                degrees, at the end: of the upright cone with the same mean height
//                             above the lowest bodies and the same mean radius
//   packing_fraction          at the end: bodies' volume over that of columns of width D from the
//                             lowest body's underside to each column's highest body
// Throws Error(input) if the trajectory has fewer than 2 frames or no dynamic body.
RunMeasures measure_run(TrajectoryReader& trajectory, int times);

// 1 for dynamic bodies (neither fixed nor kinematic), according to the scene in the header.
std::vector<uint8_t> dynamic_bodies(const TrajectoryHeader& header);

// The dissertation's errors of motion (5.3.2.4), for the displacement m = x(j+1) - x(j) of each
// body between frames. The relative error skips frames and bodies whose reference m is below 0.001
// D, where its denominator vanishes.
struct MotionError {
  double relative = 0;                    // mean of |m - m'| / |m|
  double absolute = 0;                    // mean of |m - m'|, in D
  std::vector<double> absolute_by_frame;  // (frames - 1)
};
// The motion error of two trajectories of the same bodies. Throws Error(input) if bodies or frames
// differ.
MotionError motion_error(TrajectoryReader& reference, TrajectoryReader& other);

}  // namespace pilesim
