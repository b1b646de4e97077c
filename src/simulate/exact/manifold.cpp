#include "simulate/exact/manifold.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <span>

#include "simulate/exact/exact_constants.h"

namespace pilesim::exact {

using namespace exact_constants;

namespace {

double smaller_extent(const ConvexPiece& a, const ConvexPiece& b) {
  return std::min(a.smallest_extent_m(), b.smallest_extent_m());
}

void add_corners(const ConvexPiece& piece, uint32_t face_index, std::vector<Vec3>& polygon) {
  const ConvexPiece::Face& face = piece.faces()[face_index];
  for (uint32_t i = 0; i < face.count; ++i) {
    polygon.push_back(piece.vertices()[piece.loops()[face.first + i]]);
  }
}

// A plane whose normal is that near to the axis of a round piece (sine) is across it.
constexpr double kUpright = 1e-12;

// The round side of a round piece, if it faces `direction` more than a flat face does.
std::optional<ConvexPiece::RoundSide> round_side(const ConvexPiece& piece, const Vec3& direction) {
  if (piece.kind() != ConvexPiece::Kind::round) return {};
  const std::optional<ConvexPiece::RoundSide> side = piece.round_side(direction);
  if (!side) return {};
  const uint32_t face = piece.face_along(direction);
  const bool is_flat = face != ConvexPiece::kNone &&
                       piece.faces()[face].normal.dot(direction) > side->normal.dot(direction);
  return is_flat ? std::nullopt : side;
}

// The part of a piece that faces `direction`: corners of a face, the ends of a line, or a point.
void facing(const ConvexPiece& piece, const Vec3& direction, std::vector<Vec3>& polygon) {
  polygon.clear();
  switch (piece.kind()) {
    case ConvexPiece::Kind::sphere:
      polygon.push_back(piece.vertices()[0]);
      return;
    case ConvexPiece::Kind::round: {
      if (piece.faces().empty()) {  // an arc, which may lie or stand
        const bool lies = std::abs(piece.axis().dot(direction)) > kLies;
        if (lies) polygon = piece.vertices();
        polygon.push_back(piece.farthest(direction));
        return;
      }
      if (const auto side = round_side(piece, direction)) {
        polygon.push_back(side->lower);
        if (side->upper != side->lower) polygon.push_back(side->upper);
        return;
      }
      add_corners(piece, piece.face_along(direction), polygon);
      polygon.push_back(piece.farthest(direction));  // hardly outside of the rim's polygon
      return;
    }
    case ConvexPiece::Kind::polytope:
      break;
  }
  add_corners(piece, piece.face_at(piece.farthest_vertex(direction), direction), polygon);
}

// Leaves of the polygon what is not beyond the side.
void cut(const ConvexPiece::Side& side, ManifoldScratch& scratch) {
  const std::vector<Vec3>& polygon = scratch.polygon;
  const size_t count = polygon.size();
  bool any = false;
  scratch.beyond.resize(count);
  for (size_t i = 0; i < count; ++i) {
    scratch.beyond[i] = side.normal.dot(polygon[i]) - side.offset;
    any = any || scratch.beyond[i] > 0;
  }
  if (!any) return;
  scratch.cut.clear();
  for (size_t i = 0; i < count; ++i) {
    const size_t next = i + 1 < count ? i + 1 : 0;
    const double here = scratch.beyond[i], there = scratch.beyond[next];
    if (here <= 0) scratch.cut.push_back(polygon[i]);
    if ((here < 0 && there > 0) || (here > 0 && there < 0)) {
      scratch.cut.push_back(polygon[i] + here / (here - there) * (polygon[next] - polygon[i]));
    }
  }
  std::swap(scratch.polygon, scratch.cut);
}

struct Reference {
  uint32_t face;
  double distance_m;
};

// The face of `piece` towards `normal`, if it carries the contact.
std::optional<Reference> reference(const ConvexPiece& piece, const ConvexPiece& other,
                                   const Relative& other_in_piece, const Vec3& normal,
                                   double least_m) {
  const uint32_t index = piece.face_along(normal);
  if (index == ConvexPiece::kNone) return {};
  const ConvexPiece::Face& face = piece.faces()[index];
  if (face.normal.dot(normal) < kFacing) return {};
  const Vec3 deepest =
      other_in_piece.apply(other.farthest(-(other_in_piece.turn.transpose() * face.normal)));
  const double distance = face.normal.dot(deepest) - face.offset_m - other.radius_m();
  if (distance < least_m) return {};
  return Reference{index, distance};
}

// Reduces the points from `first` on to the deepest and those that span most.
void keep_spanning(std::vector<SurfacePoint>& points, size_t first, double same_depth_m) {
  if (points.size() - first <= kMostOfPlane) return;
  const auto begin = points.begin() + static_cast<std::ptrdiff_t>(first);
  const Vec3 normal = begin->normal;
  const auto take = [&](size_t place, auto&& measure) {
    auto best = begin + static_cast<std::ptrdiff_t>(place);
    double most = -std::numeric_limits<double>::infinity();
    for (auto it = best; it != points.end(); ++it) {
      const double value = measure(*it);
      if (value > most) {
        most = value;
        best = it;
      }
    }
    std::swap(*(begin + static_cast<std::ptrdiff_t>(place)), *best);
  };
  double deepest = std::numeric_limits<double>::infinity();
  for (auto it = begin; it != points.end(); ++it) deepest = std::min(deepest, it->distance_m);
  Vec3 middle = Vec3::Zero();
  for (auto it = begin; it != points.end(); ++it) middle += it->place;
  middle /= static_cast<double>(points.size() - first);
  take(0, [&](const SurfacePoint& p) {
    return p.distance_m <= deepest + same_depth_m ? (p.place - middle).squaredNorm() : -1.0;
  });
  const Vec3 p0 = begin[0].place;
  take(1, [&](const SurfacePoint& p) { return (p.place - p0).squaredNorm(); });
  const Vec3 across = normal.cross(begin[1].place - p0);
  take(2, [&](const SurfacePoint& p) { return std::abs(across.dot(p.place - p0)); });
  // The farthest outside of the triangle of these three.
  std::array<Vec3, 3> corners = {p0, begin[1].place, begin[2].place};
  if (across.dot(corners[2] - p0) < 0) std::swap(corners[1], corners[2]);
  take(3, [&](const SurfacePoint& p) {
    double outside = -std::numeric_limits<double>::infinity();
    for (size_t k = 0; k < 3; ++k) {
      const Vec3 side = (corners[(k + 1) % 3] - corners[k]).cross(normal);
      outside = std::max(outside, side.dot(p.place - corners[k]));
    }
    return outside;
  });
  points.resize(first + kMostOfPlane);
}

// Reduces the points of a face from `first` on to those that span it, and the one that comes lowest
// in the step, by later_m(point), if that is none of these: a body that rocks falls on it.
template <typename Later>
void keep_of_face(std::vector<SurfacePoint>& points, size_t first, double same_depth_m,
                  const Later& later_m) {
  if (points.size() - first <= kMostOfPlane) return;
  const SurfacePoint coming = std::ranges::min(std::span(points).subspan(first), {}, later_m);
  keep_spanning(points, first, same_depth_m);
  const auto is_higher = [&](const SurfacePoint& kept) {
    return later_m(kept) > later_m(coming) + same_depth_m;
  };
  if (std::ranges::all_of(std::span(points).subspan(first), is_higher)) points.push_back(coming);
}

// In the frame of the piece whose face it is; normals leave that piece.
template <typename Later>
double add_points_over(const ConvexPiece& piece, uint32_t face_index, const ConvexPiece& other,
                       const Relative& other_in_piece, double reach_m, ManifoldScratch& scratch,
                       const Later& later_m, std::vector<SurfacePoint>& points) {
  const size_t first = points.size();
  const ConvexPiece::Face& face = piece.faces()[face_index];
  facing(other, -(other_in_piece.turn.transpose() * face.normal), scratch.polygon);
  for (Vec3& corner : scratch.polygon) corner = other_in_piece.apply(corner);
  const Vec3 deepest = *std::ranges::min_element(
      scratch.polygon, {}, [&](const Vec3& point) { return face.normal.dot(point); });
  const double nearest = face.normal.dot(deepest) - face.offset_m - other.radius_m();
  const double small = smaller_extent(piece, other);
  for (uint32_t i = 0; i < face.count && !scratch.polygon.empty(); ++i) {
    const ConvexPiece::Side& side = piece.sides()[face.first + i];
    cut(side, scratch);
  }
  const auto add = [&](const Vec3& point) {
    const double distance = face.normal.dot(point) - face.offset_m - other.radius_m();
    if (distance >= reach_m) return;
    points.push_back(
        {point - (distance / 2 + other.radius_m()) * face.normal, face.normal, distance});
  };
  std::ranges::for_each(scratch.polygon, add);
  keep_of_face(points, first, kSameDepth * small, later_m);
  // Corners beside the polygon that may come down within the step, as a body rolls on.
  if (other.kind() == ConvexPiece::Kind::polytope) {
    const Vec3 downward = -(other_in_piece.turn.transpose() * face.normal);
    const double level = face.normal.dot(other_in_piece.shift) - face.offset_m - reach_m;
    other.list_beyond(downward, level, scratch.vertices);
    for (const uint32_t vertex : scratch.vertices) {
      const Vec3 point = other_in_piece.apply(other.vertices()[vertex]);
      bool is_over = std::ranges::find(scratch.polygon, point) == scratch.polygon.end();
      for (uint32_t i = 0; i < face.count && is_over; ++i) {
        const ConvexPiece::Side& side = piece.sides()[face.first + i];
        is_over = side.normal.dot(point) <= side.offset;
      }
      if (is_over) add(point);
    }
  }
  return nearest;
}

// Two round sides along each other, or all but. One point would go to and fro between the ends as
// they tilt, without the force it had at the other one.
bool add_line(const ConvexPiece& a, const ConvexPiece& b, const Relative& b_in_a,
              const Separation& separation, double reach_m, std::vector<SurfacePoint>& points) {
  const auto of_a = round_side(a, separation.normal);
  const auto of_b = round_side(b, -(b_in_a.turn.transpose() * separation.normal));
  if (!of_a || !of_b) return false;
  const Vec3 from = of_a->lower, along_a = of_a->upper - from;
  const Vec3 from_b = b_in_a.apply(of_b->lower), along_b = b_in_a.apply(of_b->upper) - from_b;
  const double length = along_a.norm();
  if (length == 0 || along_b.isZero(0)) return false;
  const Vec3 axis = along_a / length;
  const double parallel = axis.dot(along_b.normalized());
  if (std::abs(parallel) < kParallel) return false;
  // Along a's line: where b's ends are beside it.
  const double first = axis.dot(from_b - from), second = first + axis.dot(along_b);
  const double low = std::max(0.0, std::min(first, second));
  const double high = std::min(length, std::max(first, second));
  if (low >= high) return false;
  // Between the round sides, so far along a's line.
  const Vec3 aside = separation.normal.cross(axis);
  const auto radius = [](const RoundSector& sector, double share) {
    return sector.bottom + share * (sector.top - sector.bottom);
  };
  const auto apart = [&](double along) {
    const double share = (along - first) / (second - first);
    const Vec3 between = from_b + share * along_b - from - along * axis;
    const double radii = radius(a.sector(), along / length) + radius(b.sector(), share);
    return std::hypot(radii + separation.normal.dot(between), aside.dot(between)) - radii;
  };
  const Vec3 between = (separation.on_a + separation.on_b) / 2;
  const double at = axis.dot(between - from);
  double nearest = std::numeric_limits<double>::infinity();
  for (const double end : {low, high}) {
    const double distance = separation.distance_m + std::max(0.0, apart(end) - apart(at));
    nearest = std::min(nearest, distance);
    if (distance >= reach_m) continue;
    points.push_back({between + (end - at) * axis, separation.normal, distance});
  }
  if (nearest > separation.distance_m + kSameDepth * smaller_extent(a, b)) {
    points.push_back({between, separation.normal, separation.distance_m});
  }
  return true;
}

double lowest_m(const std::vector<SurfacePoint>& points, size_t first) {
  return std::ranges::min(std::span(points).subspan(first), {}, &SurfacePoint::distance_m)
      .distance_m;
}

// Where the pieces touch beside the face, too, and deeper. Whether they do.
bool add_deeper(const Separation& separation, size_t first, double tolerance_m,
                std::vector<SurfacePoint>& points) {
  if (lowest_m(points, first) <= separation.distance_m + tolerance_m) return false;
  points.push_back(
      {(separation.on_a + separation.on_b) / 2, points[first].normal, separation.distance_m});
  return true;
}

}  // namespace

void keep_lowest(std::vector<SurfacePoint>& points, size_t first, double band_m,
                 double same_depth_m) {
  if (points.size() - first <= kMostOfPlane) return;
  const auto begin = points.begin() + static_cast<std::ptrdiff_t>(first);
  double deepest = std::numeric_limits<double>::infinity();
  for (auto it = begin; it != points.end(); ++it) deepest = std::min(deepest, it->distance_m);
  const auto middle = std::stable_partition(
      begin, points.end(), [&](const SurfacePoint& p) { return p.distance_m <= deepest + band_m; });
  std::vector<SurfacePoint> others(middle, points.end());
  points.erase(middle, points.end());
  keep_spanning(points, first, same_depth_m);
  std::ranges::stable_sort(others, {}, &SurfacePoint::later_m);
  const size_t rest = points.size() + std::min<size_t>(1, others.size());
  points.insert(points.end(), others.begin(), others.end());
  keep_spanning(points, rest, same_depth_m);
}

double add_manifold(const ConvexPiece& a, const ConvexPiece& b, const Relative& b_in_a,
                    const Feature& feature, double reach_m, ManifoldScratch& scratch,
                    std::vector<SurfacePoint>& points) {
  const size_t first = points.size();
  const auto later_m = [&](const Vec3& place, const Vec3& normal, double distance_m) {
    return distance_m + normal.dot(scratch.shift + scratch.turn.cross(place));
  };
  double distance;
  if (feature.of == Feature::Of::a) {
    distance = add_points_over(
        a, feature.face, b, b_in_a, reach_m, scratch,
        [&](const SurfacePoint& p) { return later_m(p.place, p.normal, p.distance_m); }, points);
  } else {
    const Relative a_in_b{b_in_a.turn.transpose(), -(b_in_a.turn.transpose() * b_in_a.shift)};
    distance = add_points_over(
        b, feature.face, a, a_in_b, reach_m, scratch,
        [&](const SurfacePoint& p) {
          return later_m(b_in_a.apply(p.place), -(b_in_a.turn * p.normal), p.distance_m);
        },
        points);
    for (size_t i = first; i < points.size(); ++i) {
      points[i].place = b_in_a.apply(points[i].place);
      points[i].normal = -(b_in_a.turn * points[i].normal);
      points[i].is_of_b = true;
    }
  }
  return distance;
}

Feature add_manifold(const ConvexPiece& a, const ConvexPiece& b, const Relative& b_in_a,
                     const Separation& separation, double reach_m, ManifoldScratch& scratch,
                     std::vector<SurfacePoint>& points) {
  const size_t first = points.size();
  const double small = smaller_extent(a, b);
  const double least = separation.distance_m - kFaceTolerance * small;
  const Relative a_in_b{b_in_a.turn.transpose(), -(b_in_a.turn.transpose() * b_in_a.shift)};
  const auto of_a = reference(a, b, b_in_a, separation.normal, least);
  const auto of_b = reference(b, a, a_in_b, -(a_in_b.turn * separation.normal), least);
  // Not a triangle's: what lies beside it is its neighbours'.
  const bool is_triangle = !std::isfinite(a.smallest_extent_m());
  Feature feature;
  if (of_a && (!of_b || of_a->distance_m + kPreference * small >= of_b->distance_m)) {
    feature = {Feature::Of::a, of_a->face};
  } else if (of_b) {
    feature = {Feature::Of::b, of_b->face};
  }
  if (feature.of != Feature::Of::none) {
    add_manifold(a, b, b_in_a, feature, reach_m, scratch, points);
    if (points.size() > first) {
      if (!is_triangle) add_deeper(separation, first, kFaceTolerance * small, points);
      return feature;
    }
    // Nothing is over the face: it may be that they pass each other beside it.
    KnownVertices none;
    const Separation apart = find_separation(a, b, b_in_a, Vec3::Zero(), reach_m, none);
    if (!apart.is_exact || apart.distance_m >= reach_m) return {};
    points.push_back({(apart.on_a + apart.on_b) / 2, apart.normal, apart.distance_m});
    return {};
  }
  for (const Feature::Of of : {Feature::Of::a, Feature::Of::b}) {
    if (is_triangle && of == Feature::Of::a) continue;
    const ConvexPiece& piece = of == Feature::Of::a ? a : b;
    const Vec3 outward =
        of == Feature::Of::a ? separation.normal : -(a_in_b.turn * separation.normal);
    const uint32_t face = piece.face_along(outward);
    if (face == ConvexPiece::kNone || piece.faces()[face].normal.dot(outward) < kNearlyFacing) {
      continue;
    }
    add_manifold(a, b, b_in_a, {of, face}, reach_m, scratch, points);
    if (points.size() > first + 1 && lowest_m(points, first) >= least) {
      const bool is_beside = add_deeper(separation, first, kFaceTolerance * small, points);
      return is_beside ? Feature{} : Feature{of, face};
    }
    points.resize(first);
  }
  if (add_line(a, b, b_in_a, separation, reach_m, points)) return {};
  points.push_back(
      {(separation.on_a + separation.on_b) / 2, separation.normal, separation.distance_m});
  return {};
}

void add_plane_manifold(const ConvexPiece& piece, const Vec3& normal, double offset_m,
                        double reach_m, ManifoldScratch& scratch,
                        std::vector<SurfacePoint>& points) {
  const auto add = [&](const Vec3& point) {
    const double distance = normal.dot(point) - offset_m - piece.radius_m();
    if (distance >= reach_m) return;
    points.push_back({point - (distance / 2 + piece.radius_m()) * normal, normal, distance});
  };
  const bool is_round = piece.kind() == ConvexPiece::Kind::round;
  const Vec3 across = is_round ? Vec3(piece.axis().cross(normal)) : Vec3::Zero();
  if (piece.kind() == ConvexPiece::Kind::polytope) {
    piece.list_beyond(-normal, -offset_m - reach_m, scratch.vertices);
    for (const uint32_t vertex : scratch.vertices) add(piece.vertices()[vertex]);
  } else if (across.isZero(kUpright)) {
    std::ranges::for_each(piece.vertices(), add);
  } else {
    // The lowest of either rim, and, a third of the way round, points that carry one that lies:
    // each sector of a ring has those on its arc.
    for (const double angle : {0.0, 2 * kPi / 3, -2 * kPi / 3}) {
      const auto side = piece.round_side(Eigen::AngleAxisd(angle, piece.axis()) * -normal);
      if (!side) continue;
      const bool has_tip = piece.sector().bottom == 0 || piece.sector().top == 0;
      if (!has_tip || angle == 0 || piece.sector().bottom > 0) add(side->lower);
      if (side->upper == side->lower) continue;
      if (!has_tip || angle == 0 || piece.sector().top > 0) add(side->upper);
    }
  }
}

}  // namespace pilesim::exact
