#include "pile/guide/vessel.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "pile/guide/guide_constants.h"

namespace pilesim {

using namespace guide_constants;

namespace {

double area_of(const std::array<Vec3, 3>& t) { return (t[1] - t[0]).cross(t[2] - t[0]).norm() / 2; }

double distance_to_segment(const Vec3& point, const std::array<Vec3, 2>& ends) {
  const Vec3 along = ends[1] - ends[0];
  const double share = std::clamp((point - ends[0]).dot(along) / along.squaredNorm(), 0.0, 1.0);
  return (point - ends[0] - share * along).norm();
}

}  // namespace

Vessel open_guide(const TriangleMesh& guide, const Vec3& up, double chute_m) {
  Vessel vessel;
  const auto [low, high] =
      std::ranges::minmax(guide.vertices, {}, [&](const Vec3& vertex) { return vertex.dot(up); });
  vessel.level_m = low.dot(up);
  vessel.height_m = high.dot(up) - vessel.level_m;
  const double level_top = vessel.level_m + kLevel * vessel.height_m;
  std::map<std::pair<uint32_t, uint32_t>, int> edges;
  vessel.walls.vertices = guide.vertices;
  for (const Triangle& t : guide.triangles) {
    const auto& v = guide.vertices;
    if (v[t[0]].dot(up) <= level_top && v[t[1]].dot(up) <= level_top &&
        v[t[2]].dot(up) <= level_top) {
      vessel.base.push_back({v[t[0]], v[t[1]], v[t[2]]});
      continue;
    }
    vessel.walls.triangles.push_back(t);
    for (int i = 0; i < 3; ++i) edges[std::pair(std::minmax({t[i], t[(i + 1) % 3]}))] += 1;
  }
  for (const auto& [edge, triangles] : edges) {
    if (triangles != 1) continue;
    const Vec3 from = guide.vertices[edge.first], to = guide.vertices[edge.second];
    vessel.rim.push_back({from, to});
    const auto next = static_cast<uint32_t>(vessel.walls.vertices.size());
    vessel.walls.vertices.push_back(from - chute_m * up);
    vessel.walls.vertices.push_back(to - chute_m * up);
    vessel.walls.triangles.push_back({edge.first, edge.second, next});
    vessel.walls.triangles.push_back({edge.second, next + 1, next});
  }
  for (const auto& triangle : vessel.base) vessel.base_m2 += area_of(triangle);
  return vessel;
}

Vec3 drop_point(const Vessel& vessel, double clearance_m, Philox draws) {
  Vec3 best = Vec3::Zero();
  double best_distance = -1;
  for (int candidate = 0; candidate < kCandidates && best_distance < clearance_m; ++candidate) {
    double rest = vessel.base_m2 * draws.uniform();
    size_t i = 0;
    while (i + 1 < vessel.base.size() && rest > area_of(vessel.base[i])) {
      rest -= area_of(vessel.base[i++]);
    }
    const auto& [a, b, c] = vessel.base[i];
    const double root = std::sqrt(draws.uniform()), share = draws.uniform();
    const Vec3 point = (1 - root) * a + root * (1 - share) * b + root * share * c;
    double distance = std::numeric_limits<double>::infinity();
    for (const auto& edge : vessel.rim) {
      distance = std::min(distance, distance_to_segment(point, edge));
    }
    if (distance > best_distance) {
      best_distance = distance;
      best = point;
    }
  }
  return best;
}

}  // namespace pilesim
