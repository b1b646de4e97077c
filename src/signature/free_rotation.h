// Torque-free rotation of four bodies of one shape at a time, as power series in the time.
#pragma once

#include <array>
#include <cstddef>

#include "core/types.h"

namespace pilesim {

inline constexpr size_t kFlightLanes = 4;

// One value a lane.
struct alignas(32) Lanes {
  std::array<double, kFlightLanes> of{};
  double& operator[](size_t lane) { return of[lane]; }
  double operator[](size_t lane) const { return of[lane]; }
};

// One vector of the body frame a lane.
struct LaneVectors {
  Lanes x, y, z;
  void set(size_t lane, const Vec3& v) {
    x[lane] = v.x();
    y[lane] = v.y();
    z[lane] = v.z();
  }
  Vec3 get(size_t lane) const { return {x[lane], y[lane], z[lane]}; }
};

// A fixed direction of the world, seen from the body, and the spin over a step: the sums of
// coefficient[k] s^k, s from 0 to 1 over the step.
struct RotationSeries {
  static constexpr size_t kOrder = 10;
  // Steps in which a body turns by more are cut short, rad: up to there what the series leave out
  // is below 1e-9.
  static constexpr double kLongestTurn = 0.5;

  std::array<LaneVectors, kOrder + 1> direction;  // unit
  std::array<LaneVectors, kOrder + 1> turn;       // rad: the spin times the step
};

// The direction over one of kSegments equal parts of the step: a cubic in u, from 0 to 1 over it,
// and the rest.
struct DirectionSegment {
  static constexpr size_t kSegments = 2;
  static constexpr double kLength = 1.0 / kSegments;  // of the step

  std::array<LaneVectors, 4> direction;
  Lanes tail;          // bound of |what the cubic leaves out|
  LaneVectors middle;  // the direction, nearly, at u = 1/2; not unit
  Lanes deviation;     // from there at most, over the segment
};

// `spin` in rad/s, `step_s` such that no body turns by more than kLongestTurn. `euler`: see
// ContactBody.
void expand_rotation(const Vec3& euler, const LaneVectors& direction, const LaneVectors& spin,
                     const Lanes& step_s, RotationSeries& series);

// Segment `number` of the series.
void cut_segment(const RotationSeries& series, size_t number, DirectionSegment& segment);

// Direction and spin (rad/s) at `part` of the step; where step_s is 0 the spin stays.
void evaluate_rotation(const RotationSeries& series, const Lanes& part, const Lanes& step_s,
                       LaneVectors& direction, LaneVectors& spin);

}  // namespace pilesim
