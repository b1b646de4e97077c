#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <tuple>
#include <utility>
#include <vector>

#include "render/scene_renderer.h"

namespace pilesim {
namespace {

// From in front, to the right and above, as one looks at a table.
const Vec3 kViewDirection = Vec3(0.5, 0.42, 0.86).normalized();
constexpr double kFieldOfView = radians(35);
constexpr uint64_t kFramesLookedAt = 48;
constexpr size_t kBodiesLookedAt = 20'000;  // in each, about; in the last one all
constexpr int kTurns = 8;                   // places around the scene that are tried
// Share of the positions in each axis that is left out: a body that rolls far away does not make
// all others small.
constexpr double kLeftOut = 0.02;
// The bulk is three quarters of the positions in each axis. Farther from it than this share of its
// greatest extent, and than so many radii, bodies are strays, which nobody looks for. A pile that
// is as dense everywhere, or a cone, has none.
constexpr double kOutside = 0.125;
constexpr double kStray = 0.5;
constexpr double kStrayRadii = 2;
constexpr int kRounds = 4;  // in which the camera finds the middle

std::vector<uint8_t> solids(const TrajectoryHeader& header) {
  std::vector<uint8_t> solid;
  for (const uint32_t shape : header.body_shape) solid.push_back(!header.shapes[shape].is_plane);
  return solid;
}

// Which bodies the picture is about: those that move or, without any, all that are not planes.
std::vector<uint8_t> of_interest(const TrajectoryHeader& header) {
  if (std::ranges::any_of(header.body_moves, [](uint8_t m) { return m != 0; })) {
    return header.body_moves;
  }
  return solids(header);
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

using Places = std::vector<Vec3>;

void add_places(const TrajectoryFrame& frame, const std::vector<uint8_t>& included,
                Places& places) {
  for (size_t body = 0; body < included.size(); ++body) {
    if (!included[body] || (frame.state[body] & kPresent) == 0) continue;
    places.push_back(frame.position[body]);
  }
}

std::vector<double> sorted_coordinates(const Places& places, int axis) {
  std::vector<double> values;
  for (const Vec3& place : places) values.push_back(place[axis]);
  std::ranges::sort(values);
  return values;
}

// The least and the greatest value without this share of them at either end.
std::pair<double, double> without_ends(const std::vector<double>& sorted, double share) {
  const auto left_out = static_cast<size_t>(share * static_cast<double>(sorted.size() - 1));
  return {sorted[left_out], sorted[sorted.size() - 1 - left_out]};
}

// The subject of the picture: all bodies of the last frame but strays, and the places near them
// where bodies often are in other frames.
Places places_to_see(TrajectoryReader& trajectory, const std::vector<uint8_t>& included,
                     double radius) {
  const uint64_t stride = std::max<uint64_t>(1, trajectory.frame_count() / kFramesLookedAt);
  const std::vector<uint8_t> some = some_of(included);
  Places all, last;
  TrajectoryFrame frame;
  for (uint64_t index = 0; index < trajectory.frame_count(); index += stride) {
    trajectory.read(index, frame);
    add_places(frame, some, all);
  }
  trajectory.read(trajectory.frame_count() - 1, frame);
  add_places(frame, included, last);
  if (all.empty()) return last;
  if (last.empty()) last = all;

  Bounds bulk, usual;
  for (int axis = 0; axis < 3; ++axis) {
    std::tie(bulk.min()[axis], bulk.max()[axis]) =
        without_ends(sorted_coordinates(last, axis), kOutside);
    std::tie(usual.min()[axis], usual.max()[axis]) =
        without_ends(sorted_coordinates(all, axis), kLeftOut);
  }
  const double reach = std::max(kStrayRadii * radius, kStray * bulk.sizes().maxCoeff());
  const Bounds near(bulk.min().array() - reach, bulk.max().array() + reach);
  const Bounds often = near.intersection(usual);
  std::erase_if(last, [&](const Vec3& place) { return !near.contains(place); });
  std::ranges::copy_if(all, std::back_inserter(last),
                       [&](const Vec3& place) { return often.contains(place); });
  return last;
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

}  // namespace

CameraKey frame_places(const Vec3& direction, const std::vector<Vec3>& places, double radius,
                       double aspect, double filled) {
  const Vec3 forward = -direction;
  const Vec3 right = forward.cross(Vec3::UnitY()).normalized();
  const Vec3 up = right.cross(forward);
  const double tan_high = filled * std::tan(kFieldOfView / 2);
  const double tan_wide = tan_high * aspect;
  Bounds box;
  for (const Vec3& place : places) box.extend(place);
  Vec3 target = box.center();
  double distance = 0;
  for (int round = 0; round < kRounds; ++round) {
    distance = 0;
    for (const Vec3& place : places) {
      const Vec3 offset = place - target;
      const double sideways = std::max((std::abs(right.dot(offset)) + radius) / tan_wide,
                                       (std::abs(up.dot(offset)) + radius) / tan_high);
      distance = std::max(distance, sideways - forward.dot(offset));
    }
    if (round + 1 == kRounds) break;
    Eigen::AlignedBox2d seen;
    for (const Vec3& place : places) {
      const Vec3 offset = place - target;
      seen.extend(Eigen::Vector2d(right.dot(offset), up.dot(offset)) /
                  (distance + forward.dot(offset)));
    }
    target += distance * (seen.center().x() * right + seen.center().y() * up);
  }
  return {.time_s = 0,
          .position = target + distance * direction,
          .target = target,
          .field_of_view = kFieldOfView};
}

CameraKey frame_action(TrajectoryReader& trajectory, double aspect) {
  const TrajectoryHeader& header = trajectory.header();
  const std::vector<uint8_t> included = of_interest(header);
  const double radius = std::max(1e-6, largest_radius(header, included));
  Places places = places_to_see(trajectory, included, radius);
  if (places.empty()) places = places_to_see(trajectory, solids(header), radius);
  if (places.empty()) places.emplace_back(Vec3::Zero());

  // A plane is not drawn from behind: walk around the scene to where most are seen.
  TrajectoryFrame first;
  trajectory.read(0, first);
  CameraKey best;
  size_t fewest_behind = std::numeric_limits<size_t>::max();
  for (int turn = 0; turn < kTurns && fewest_behind > 0; ++turn) {
    const Eigen::AngleAxisd around(2 * kPi * turn / kTurns, Vec3::UnitY());
    const CameraKey key = frame_places(around * kViewDirection, places, radius, aspect);
    const size_t behind = planes_behind(header, first, key.position);
    if (behind >= fewest_behind) continue;
    fewest_behind = behind;
    best = key;
  }
  return best;
}

}  // namespace pilesim
