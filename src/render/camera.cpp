#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "render/scene_renderer.h"

namespace pilesim {
namespace {

// From in front, to the right and above, as one looks at a table.
const Vec3 kViewDirection = Vec3(0.5, 0.42, 0.86).normalized();
constexpr double kFieldOfView = radians(35);
constexpr double kMargin = 1.06;
constexpr uint64_t kFramesLookedAt = 48;
constexpr size_t kBodiesLookedAt = 20'000;  // in each, about; in the last one all
constexpr int kTurns = 8;                   // places around the scene that are tried
// Of the positions in each axis: a body that rolls far away does not make all others small.
constexpr double kLeftOut = 0.02;
// The bulk is three quarters of the positions in each axis. Farther from it than this many times
// its greatest extent, and than so many radii, bodies are no longer part of what there is to see.
constexpr double kOutside = 0.125;
constexpr double kFarOff = 2;
constexpr double kFarOffRadii = 8;

// Which bodies the picture is about: those that move or, without any, all that are not planes.
std::vector<uint8_t> of_interest(const TrajectoryHeader& header) {
  if (std::ranges::any_of(header.body_moves, [](uint8_t m) { return m != 0; })) {
    return header.body_moves;
  }
  std::vector<uint8_t> solid;
  for (const uint32_t shape : header.body_shape) solid.push_back(!header.shapes[shape].is_plane);
  return solid;
}

double largest_radius(const TrajectoryHeader& header, const std::vector<uint8_t>& included) {
  std::vector<uint8_t> used(header.shapes.size());
  for (size_t body = 0; body < included.size(); ++body) {
    if (included[body]) used[header.body_shape[body]] = 1;
  }
  double radius = 0;
  for (size_t shape = 0; shape < used.size(); ++shape) {
    if (!used[shape]) continue;
    for (const Vec3f& v : header.shapes[shape].vertices) {
      radius = std::max<double>(radius, v.norm());
    }
  }
  return radius;
}

// Some of many, as scattered as a share of golden sections is: bodies lie in rows.
std::vector<uint8_t> some_of(const std::vector<uint8_t>& included) {
  constexpr uint32_t kGoldenSection = 2654435769;  // of 2^32
  if (included.size() <= kBodiesLookedAt) return included;
  const double share = static_cast<double>(kBodiesLookedAt) / static_cast<double>(included.size());
  const auto below = static_cast<uint32_t>(share * 4294967296.0);
  std::vector<uint8_t> some(included.size());
  for (uint32_t body = 0; body < included.size(); ++body) {
    some[body] = static_cast<uint8_t>(included[body] != 0 && kGoldenSection * body < below);
  }
  return some;
}

using Samples = std::array<std::vector<double>, 3>;  // of x, y, z

void sample_positions(const TrajectoryFrame& frame, const std::vector<uint8_t>& included,
                      Samples& samples) {
  for (size_t body = 0; body < included.size(); ++body) {
    if (!included[body] || (frame.state[body] & kPresent) == 0) continue;
    for (int axis = 0; axis < 3; ++axis) {
      samples[static_cast<size_t>(axis)].push_back(frame.position[body][axis]);
    }
  }
}

double quantile(const std::vector<double>& sorted, double share) {
  return sorted[static_cast<size_t>(share * static_cast<double>(sorted.size() - 1))];
}

// Of all frames without what is rare, and of the last frame, the one that stays in the mind, all;
// in both without what is far off.
Bounds robust_bounds(TrajectoryReader& trajectory, const std::vector<uint8_t>& included,
                     double radius) {
  const uint64_t stride = std::max<uint64_t>(1, trajectory.frame_count() / kFramesLookedAt);
  const std::vector<uint8_t> some = some_of(included);
  Samples samples, last;
  TrajectoryFrame frame;
  for (uint64_t index = 0; index < trajectory.frame_count(); index += stride) {
    trajectory.read(index, frame);
    sample_positions(frame, some, samples);
  }
  trajectory.read(trajectory.frame_count() - 1, frame);
  sample_positions(frame, included, last);

  double reach = kFarOffRadii * radius;
  for (std::vector<double>& values : samples) {
    if (values.empty()) return {Vec3::Zero(), Vec3::Zero()};
    std::ranges::sort(values);
    reach =
        std::max(reach, kFarOff * (quantile(values, 1 - kOutside) - quantile(values, kOutside)));
  }
  Vec3 low, high;
  for (int axis = 0; axis < 3; ++axis) {
    const std::vector<double>& values = samples[static_cast<size_t>(axis)];
    const double lowest = quantile(values, kOutside) - reach;
    const double highest = quantile(values, 1 - kOutside) + reach;
    low[axis] = std::max(lowest, quantile(values, kLeftOut));
    high[axis] = std::min(highest, quantile(values, 1 - kLeftOut));
    for (const double value : last[static_cast<size_t>(axis)]) {
      if (value < lowest || value > highest) continue;
      low[axis] = std::min(low[axis], value);
      high[axis] = std::max(high[axis], value);
    }
  }
  return {low, high};
}

size_t planes_behind(const TrajectoryHeader& header, const TrajectoryFrame& frame,
                     const Vec3& eye) {
  size_t count = 0;
  for (size_t body = 0; body < header.body_count(); ++body) {
    if (!header.shapes[header.body_shape[body]].is_plane) continue;
    const Vec3 normal = frame.orientation[body].cast<double>() * Vec3::UnitY();
    if (normal.dot(eye - frame.position[body]) <= 0) ++count;
  }
  return count;
}

// From `direction` seen from its middle, all of `bounds` is in the picture.
CameraKey look_from(const Vec3& direction, const Bounds& bounds, double aspect) {
  const Vec3 target = bounds.center();
  const Vec3 forward = -direction;
  const Vec3 right = forward.cross(Vec3::UnitY()).normalized();
  const Vec3 up = right.cross(forward);
  const double tan_high = std::tan(kFieldOfView / 2);
  const double tan_wide = tan_high * aspect;
  double distance = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 offset = bounds.corner(static_cast<Bounds::CornerType>(corner)) - target;
    const double sideways =
        std::max(std::abs(right.dot(offset)) / tan_wide, std::abs(up.dot(offset)) / tan_high);
    distance = std::max(distance, sideways - forward.dot(offset));
  }
  return {.time_s = 0,
          .position = target + kMargin * distance * direction,
          .target = target,
          .field_of_view = kFieldOfView};
}

}  // namespace

CameraKey frame_action(TrajectoryReader& trajectory, double aspect) {
  const TrajectoryHeader& header = trajectory.header();
  const std::vector<uint8_t> included = of_interest(header);
  const double radius = std::max(1e-6, largest_radius(header, included));
  Bounds bounds = robust_bounds(trajectory, included, radius);
  bounds.extend(Vec3(bounds.min() - Vec3::Constant(radius)));
  bounds.extend(Vec3(bounds.max() + Vec3::Constant(radius)));

  // A plane is not drawn from behind: walk around the scene to where most are seen.
  TrajectoryFrame first;
  trajectory.read(0, first);
  CameraKey best;
  size_t fewest_behind = std::numeric_limits<size_t>::max();
  for (int turn = 0; turn < kTurns && fewest_behind > 0; ++turn) {
    const Eigen::AngleAxisd around(2 * kPi * turn / kTurns, Vec3::UnitY());
    const CameraKey key = look_from(around * kViewDirection, bounds, aspect);
    const size_t behind = planes_behind(header, first, key.position);
    if (behind >= fewest_behind) continue;
    fewest_behind = behind;
    best = key;
  }
  return best;
}

}  // namespace pilesim
