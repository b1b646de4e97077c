#include "signature/rest/rest_flow.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace pilesim {

using Side = GaussMap::Side;

// The cells that share the face as a corner, counter-clockwise, each as the side that starts there.
std::vector<Side> RestFlow::cells_round(uint32_t face) const {
  std::vector<Side> round;
  Side at = map_.cell_at[face];
  do {
    round.push_back(at);
    at = map_.across[at.cell][(at.corner + 2) % 3];
  } while (at.cell != round.front().cell);
  return round;
}

bool RestFlow::stable(uint32_t face) const {
  return std::ranges::all_of(cells_round(face), [&](const Side& side) {
    return map_.clearance(face, map_.face(side, 1)) > 0;
  });
}

// The side over which a great circle that entered over `in` leaves the cell. `left` is its normal,
// to the left of the direction of travel.
Side RestFlow::way_out(const Side& in, const Vec3& left) const {
  const bool opposite_is_left = left.dot(map_.normals[map_.face(in, 2)]) > 0;
  return {in.cell, (in.corner + (opposite_is_left ? 1 : 2)) % 3};
}

// Intersection of the great circle with the side, always between its ends.
Vec3 RestFlow::crossing(const Side& side, const Vec3& left) const {
  const Vec3& a = map_.normals[map_.face(side)];
  const Vec3& b = map_.normals[map_.face(side, 1)];
  const double to_a = std::abs(left.dot(a)), to_b = std::abs(left.dot(b));
  if (!(to_a + to_b > 0)) return (a + b).stableNormalized();
  return (to_b * a + to_a * b).stableNormalized();
}

// Follows the flow that leaves a cell over `out` at `d` through other cells to a valley, and along
// the valley to the face at its end.
uint32_t RestFlow::descend(Side out, Vec3 d) const {
  for (size_t guard = 0; guard < map_.cells.size(); ++guard) {
    const Side in = map_.across[out.cell][out.corner];
    if (!map_.flows_in(in) || map_.flows_in(out)) break;
    const Vec3 left = map_.apexes[in.cell].cross(d);
    out = way_out(in, left);
    d = crossing(out, left);
  }
  const uint32_t a = map_.face(out), b = map_.face(out, 1);
  const Vec3 axis = map_.normals[a].cross(map_.normals[b]);
  return map_.foot(out).cross(d).dot(axis) > 0 ? b : a;
}

// Where the centre of mass does not project into the face, the flow starts at its normal and leads
// away from the face's point nearest to the projection.
uint32_t RestFlow::leave_face(uint32_t face) const {
  const Vec3& normal = map_.normals[face];
  const Vec3 foot = map_.heights[face] * normal;
  const std::vector<Side> round = cells_round(face);
  double least = std::numeric_limits<double>::infinity();
  Vec3 nearest = foot;
  uint32_t beyond_edge = face;  // or the face itself, at a corner
  for (size_t i = 0; i < round.size(); ++i) {
    const Vec3& a = map_.apexes[round[i].cell];
    const Vec3 along = map_.apexes[round[(i + 1) % round.size()].cell] - a;
    const double share = along.squaredNorm() > 0 ? along.dot(foot - a) / along.squaredNorm() : 0;
    const Vec3 point = a + std::clamp(share, 0.0, 1.0) * along;
    const double distance = (foot - point).norm();
    if (!(distance < least)) continue;
    least = distance;
    nearest = point;
    beyond_edge = share > 0 && share < 1 ? map_.face(round[i], 2) : face;
  }
  if (beyond_edge != face) return beyond_edge;

  const Vec3 left = normal.cross(foot - nearest);
  double best = -std::numeric_limits<double>::infinity();
  Side start = round.front();
  for (const Side& side : round) {
    const Vec3& first = map_.normals[map_.face(side, 1)];
    const Vec3& second = map_.normals[map_.face(side, 2)];
    const double within = std::min(-left.dot(first) / normal.cross(first).norm(),
                                   left.dot(second) / normal.cross(second).norm());
    if (within > best) {
      best = within;
      start = side;
    }
  }
  const Side out{start.cell, (start.corner + 1) % 3};
  return descend(out, crossing(out, left));
}

uint32_t RestFlow::from_face(uint32_t face) const {
  // U falls from face to face, except for rounding.
  for (size_t guard = 0; guard < map_.normals.size() && !stable(face); ++guard) {
    face = leave_face(face);
  }
  return face;
}

uint32_t RestFlow::from_direction(const Vec3& down) const {
  uint32_t cell = 0;
  double deepest = -std::numeric_limits<double>::infinity();
  for (uint32_t c = 0; c < map_.cells.size(); ++c) {
    double inside = std::numeric_limits<double>::infinity();
    for (uint32_t k = 0; k < 3; ++k) {
      const Side side{c, k};
      const Vec3 axis = map_.normals[map_.face(side)].cross(map_.normals[map_.face(side, 1)]);
      inside = std::min(inside, down.dot(axis));
    }
    if (inside > deepest) {
      deepest = inside;
      cell = c;
    }
  }
  const Vec3& apex = map_.apexes[cell];
  const Vec3 left = apex.cross(down);
  const Vec3 ahead = down.dot(apex) * down - apex;
  // The great circle crosses two sides, one of them in the direction of travel.
  Side out{cell, 0};
  Vec3 exit = down;
  double farthest = -std::numeric_limits<double>::infinity();
  for (uint32_t k = 0; k < 3; ++k) {
    const Side side{cell, k};
    const double a = left.dot(map_.normals[map_.face(side)]);
    const double b = left.dot(map_.normals[map_.face(side, 1)]);
    if (a * b > 0) continue;
    const Vec3 point = crossing(side, left);
    if (point.dot(ahead) <= farthest) continue;
    farthest = point.dot(ahead);
    out = side;
    exit = point;
  }
  return from_face(descend(out, exit));
}

std::vector<Saddle> RestFlow::saddles() const {
  std::vector<Saddle> saddles;
  for (uint32_t c = 0; c < map_.cells.size(); ++c) {
    for (uint32_t k = 0; k < 3; ++k) {
      const Side side{c, k}, other = map_.across[c][k];
      if (other.cell < c) continue;
      const uint32_t a = map_.face(side), b = map_.face(side, 1);
      if (!(map_.clearance(a, b) > 0 && map_.clearance(b, a) > 0)) continue;
      if (map_.flows_in(side) || map_.flows_in(other)) continue;
      saddles.push_back({side});
    }
  }
  return saddles;
}

// Follows the flow uphill from the last of `points`, on the side `in` of a cell, to a peak.
void RestFlow::climb(Side in, std::vector<Vec3>& points) const {
  for (size_t guard = 0; guard < map_.cells.size(); ++guard) {
    const Vec3 apex = map_.apexes[in.cell].stableNormalized();
    const Vec3 left = points.back().cross(apex);
    const Side out = way_out(in, left);
    if (!map_.flows_in(out)) {
      points.push_back(apex);
      return;
    }
    points.push_back(crossing(out, left));
    in = map_.across[out.cell][out.corner];
  }
}

std::vector<Vec3> RestFlow::border(const Saddle& saddle) const {
  const Vec3 top = map_.foot(saddle.side).stableNormalized();
  std::vector<Vec3> border = {top};
  climb(map_.across[saddle.side.cell][saddle.side.corner], border);
  std::ranges::reverse(border);
  climb(saddle.side, border);
  return border;
}

size_t RestFlow::peak_count() const {
  size_t peaks = 0;
  for (uint32_t c = 0; c < map_.cells.size(); ++c) {
    const bool peak = !map_.flows_in({c, 0}) && !map_.flows_in({c, 1}) && !map_.flows_in({c, 2});
    peaks += peak ? 1 : 0;
  }
  return peaks;
}

}  // namespace pilesim
