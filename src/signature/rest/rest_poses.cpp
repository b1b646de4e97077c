#include "signature/rest/rest_poses.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <ranges>
#include <string>
#include <utility>

#include "core/error.h"
#include "geometry/convex_hull.h"
#include "signature/rest/rest_flow.h"

namespace pilesim {
namespace {

// Relative shifts that separate coincident planes where the flow on them is undecided.
constexpr std::array<double, 5> kShifts = {0, 1e-12, 1e-11, 1e-10, 1e-9};
// Largest error of the basins' total area.
constexpr double kAreaError = 1e-6;

// The sum over a border is the area up to whole spheres, since its triangles may wind around.
// Rounding may put an empty basin just below 0.
double area_of_sum(double sum) {
  const double sphere = 4 * kPi;
  const double area = sum - sphere * std::floor(sum / sphere);
  return area > sphere * (1 - 1e-12) ? 0 : area;
}

size_t find_root(std::vector<size_t>& parent, size_t i) {
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

// Numbers families from 0 in order of first appearance.
void number_families(std::vector<RestPose>& poses) {
  std::map<uint32_t, uint32_t> number;
  for (RestPose& pose : poses) {
    const auto next = static_cast<uint32_t>(number.size());
    pose.family = number.emplace(pose.family, next).first->second;
  }
}

// Signed solid angle of a spherical triangle (Van Oosterom and Strackee 1983), positive when a, b,
// c turn to the left seen from outside.
double solid_angle(const Vec3& a, const Vec3& b, const Vec3& c) {
  return 2 * std::atan2(a.dot(b.cross(c)), 1 + a.dot(b) + b.dot(c) + c.dot(a));
}

// Empty if the basins do not cover the sphere exactly once.
std::optional<std::vector<RestPose>> poses_on(const GaussMap& map) {
  const RestFlow flow(map);

  // Each saddle's two descending flow lines end in minima, and its two ascending lines are the
  // border between their basins. A basin's area is the sum of triangles from its minimum to its
  // border.
  const std::vector<Saddle> saddles = flow.saddles();
  // Extremes and saddles of any function on the sphere: peaks - saddles + pits = 2.
  size_t stable = 0;
  for (uint32_t f = 0; f < map.normals.size(); ++f) stable += flow.stable(f) ? 1 : 0;
  if (stable == 0 || flow.peak_count() + stable != saddles.size() + 2) return std::nullopt;

  std::vector<double> area(map.normals.size(), 0);
  std::vector<size_t> family(map.normals.size());
  std::iota(family.begin(), family.end(), size_t{0});
  for (const Saddle& saddle : saddles) {
    const uint32_t left = flow.from_face(map.face(saddle.side));
    const uint32_t right = flow.from_face(map.face(saddle.side, 1));
    if (left == right) continue;
    const double top_m = map.foot(saddle.side).norm();
    const double lower_m = std::min(map.heights[left], map.heights[right]);
    if (top_m <= (1 + kFamilyBarrier) * lower_m) {
      family[find_root(family, left)] = find_root(family, right);
    }
    const std::vector<Vec3> border = flow.border(saddle);
    for (size_t i = 0; i + 1 < border.size(); ++i) {
      area[left] += solid_angle(map.normals[left], border[i], border[i + 1]);
      area[right] += solid_angle(map.normals[right], border[i + 1], border[i]);
    }
  }

  std::vector<RestPose> poses;
  double sum = 0;
  for (uint32_t f = 0; f < map.normals.size(); ++f) {
    if (!flow.stable(f)) continue;
    const double share = stable == 1 ? 1 : area_of_sum(area[f]) / (4 * kPi);
    sum += share;
    poses.push_back({.up = -map.normals[f],
                     .height_m = map.heights[f],
                     .probability = share,
                     .family = static_cast<uint32_t>(find_root(family, f))});
  }
  if (!(std::abs(sum - 1) <= kAreaError)) return std::nullopt;
  std::ranges::stable_sort(poses, std::greater{}, &RestPose::probability);
  number_families(poses);
  return poses;
}

}  // namespace

std::vector<RestPose> stable_rest_poses(const TriangleMesh& hull) {
  for (const double shift : kShifts) {
    if (auto poses = poses_on(make_gauss_map(hull, shift))) return *std::move(poses);
  }
  throw Error(ErrorKind::internal,
              Problem{.found = "a hull of " + std::to_string(hull.vertices.size()) +
                               " vertices whose rest poses do not share the sphere of directions"});
}

std::vector<RestPose> mesh_rest_poses(const TriangleMesh& mesh, const Vec3& centre_of_mass) {
  TriangleMesh hull = convex_hull(mesh.vertices);
  for (Vec3& v : hull.vertices) v -= centre_of_mass;
  hull.rounding_m = mesh.rounding_m;
  return stable_rest_poses(hull);
}

std::vector<size_t> roll_to_rest(const TriangleMesh& hull, const std::vector<RestPose>& poses,
                                 std::span<const Vec3> downs) {
  const GaussMap map = make_gauss_map(hull);
  const RestFlow flow(map);
  std::vector<size_t> reached;
  for (const Vec3& down : downs) {
    const Vec3 up = -map.normals[flow.from_direction(down)];
    const auto pose =
        std::ranges::max_element(poses, {}, [&](const RestPose& p) { return up.dot(p.up); });
    reached.push_back(static_cast<size_t>(pose - poses.begin()));
  }
  return reached;
}

std::vector<RestPose> cluster_rest_poses(const std::vector<RestPose>& poses, double angle,
                                         double least_probability) {
  std::vector<RestPose> clusters;
  for (const RestPose& pose : poses) {
    const auto near = std::ranges::find_if(
        clusters, [&](const RestPose& c) { return c.up.dot(pose.up) >= std::cos(angle); });
    if (near == clusters.end()) {
      clusters.push_back(pose);
    } else {
      near->probability += pose.probability;
    }
  }
  std::map<uint32_t, double> together;
  for (const RestPose& c : clusters) together[c.family] += c.probability;
  std::erase_if(clusters,
                [&](const RestPose& c) { return together[c.family] < least_probability; });
  std::ranges::stable_sort(clusters, std::greater{}, &RestPose::probability);
  return clusters;
}

}  // namespace pilesim
