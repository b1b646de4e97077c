#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "render/scene_renderer.h"

namespace pilesim {
namespace {

// From in front, to the right and above, as one looks at a table.
const Vec3 kViewDirection = Vec3(0.5, 0.42, 0.86).normalized();
constexpr double kFieldOfView = radians(35);
constexpr double kMargin = 1.06;
constexpr uint64_t kFramesLookedAt = 48;
// Of the positions in each axis: a body that rolls far away does not make all others small.
constexpr double kLeftOut = 0.02;
// Bit 0 of a body's state in a trajectory.
constexpr uint8_t kPresent = 1;

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

std::array<std::vector<double>, 3> sampled_positions(TrajectoryReader& trajectory,
                                                     const std::vector<uint8_t>& included) {
  const uint64_t stride = std::max<uint64_t>(1, trajectory.frame_count() / kFramesLookedAt);
  std::array<std::vector<double>, 3> samples;
  TrajectoryFrame frame;
  for (uint64_t index = 0; index < trajectory.frame_count(); index += stride) {
    trajectory.read(index, frame);
    for (size_t body = 0; body < included.size(); ++body) {
      if (!included[body] || (frame.state[body] & kPresent) == 0) continue;
      for (int axis = 0; axis < 3; ++axis) {
        samples[static_cast<size_t>(axis)].push_back(frame.position[body][axis]);
      }
    }
  }
  return samples;
}

Bounds robust_bounds(std::array<std::vector<double>, 3> samples) {
  Vec3 low = Vec3::Zero();
  Vec3 high = Vec3::Zero();
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double>& values = samples[static_cast<size_t>(axis)];
    if (values.empty()) continue;
    std::ranges::sort(values);
    const auto cut = static_cast<size_t>(kLeftOut * static_cast<double>(values.size()));
    low[axis] = values[cut];
    high[axis] = values[values.size() - 1 - cut];
  }
  return {low, high};
}

}  // namespace

CameraKey frame_action(TrajectoryReader& trajectory, double aspect) {
  const std::vector<uint8_t> included = of_interest(trajectory.header());
  Bounds bounds = robust_bounds(sampled_positions(trajectory, included));
  const double radius = std::max(1e-6, largest_radius(trajectory.header(), included));
  bounds.extend(Vec3(bounds.min() - Vec3::Constant(radius)));
  bounds.extend(Vec3(bounds.max() + Vec3::Constant(radius)));

  const Vec3 target = bounds.center();
  const Vec3 forward = -kViewDirection;
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
          .position = target + kMargin * distance * kViewDirection,
          .target = target,
          .field_of_view = kFieldOfView};
}

CameraKey camera_at(const Camera& camera, double time_s) {
  const std::vector<CameraKey>& keys = camera.keys;
  const auto after = std::ranges::upper_bound(keys, time_s, {}, &CameraKey::time_s);
  if (after == keys.begin()) return keys.front();
  if (after == keys.end()) return keys.back();
  const auto k = static_cast<size_t>(after - keys.begin());
  const CameraKey& a = keys[k - 1];
  const CameraKey& b = keys[k];
  const double span = b.time_s - a.time_s;
  const double u = (time_s - a.time_s) / span;

  // Cubic Hermite with the slopes of the neighbouring keys; it starts and stops at rest.
  const auto blend = [&](auto value) {
    using T = decltype(value(a));
    const auto slope = [&](size_t i) -> T {
      if (i == 0 || i + 1 == keys.size()) return T(0 * value(keys[i]));
      const double dt = keys[i + 1].time_s - keys[i - 1].time_s;
      return T((value(keys[i + 1]) - value(keys[i - 1])) / dt);
    };
    const double u2 = u * u;
    const double u3 = u2 * u;
    return T((2 * u3 - 3 * u2 + 1) * value(a) + (u3 - 2 * u2 + u) * span * slope(k - 1) +
             (3 * u2 - 2 * u3) * value(b) + (u3 - u2) * span * slope(k));
  };
  return {.time_s = time_s,
          .position = blend([](const CameraKey& key) { return key.position; }),
          .target = blend([](const CameraKey& key) { return key.target; }),
          .field_of_view = blend([](const CameraKey& key) { return key.field_of_view; })};
}

}  // namespace pilesim
