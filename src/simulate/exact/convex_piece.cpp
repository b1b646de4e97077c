#include "simulate/exact/convex_piece.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <span>

#include "geometry/hull_faces.h"
#include "geometry/primitives.h"
#include "simulate/exact/exact_constants.h"
#include "simulate/exact/lanes.h"

namespace pilesim::exact {
namespace {

void fill_blocks(std::span<const Vec3> points, std::vector<float>& values) {
  const size_t blocks = (points.size() + kVertexLanes - 1) / kVertexLanes;
  values.resize(blocks * 3 * kVertexLanes);
  for (size_t i = 0; i < blocks * kVertexLanes; ++i) {
    const Vec3& point = points[i < points.size() ? i : 0];
    float* block = values.data() + i / kVertexLanes * 3 * kVertexLanes + i % kVertexLanes;
    for (size_t k = 0; k < 3; ++k) block[k * kVertexLanes] = static_cast<float>(point[k]);
  }
}

// The products of a block of vertices with `direction`.
HWY_INLINE Lanes<float> product(const float* block, const Vec3& direction) {
  using F = Lanes<float>;
  const F x(static_cast<float>(direction.x())), y(static_cast<float>(direction.y())),
      z(static_cast<float>(direction.z()));
  return mul_add(F::load(block), x,
                 mul_add(F::load(block + kVertexLanes), y, F::load(block + 2 * kVertexLanes) * z));
}

// The first of the greatest products with `direction`.
uint32_t greatest(const std::vector<float>& blocks, const Vec3& direction) {
  using F = Lanes<float>;
  F best = product(blocks.data(), direction);
  F best_block(0.0F);
  for (size_t at = 3 * kVertexLanes; at < blocks.size(); at += 3 * kVertexLanes) {
    const F candidate = product(blocks.data() + at, direction);
    const size_t number = at / (3 * kVertexLanes);
    const auto more = candidate > best;
    best = select(more, candidate, best);
    best_block = select(more, F(static_cast<float>(number)), best_block);
  }
  const F::Tag tag;
  uint8_t lanes = 0;
  hn::StoreMaskBits(tag, hn::Eq(best.v, hn::MaxOfLanes(tag, best.v)), &lanes);
  const auto lane = static_cast<uint32_t>(std::countr_zero(lanes));
  alignas(32) float block[kVertexLanes];
  best_block.store(block);
  return static_cast<uint32_t>(block[lane]) * static_cast<uint32_t>(kVertexLanes) + lane;
}

// A direction this near to the axis (sine) has no angle about it.
constexpr double kAlongAxis = 1e-12;

// Corners that are one but for rounding: by vertex, the first of those that it is one with. A side
// from one to the other would point anywhere, and cut off what lies over the face.
std::vector<uint32_t> joined_corners(const TriangleMesh& hull) {
  const double same_m = face_tolerance(hull);
  std::vector<uint32_t> corner_of(hull.vertices.size()), corners;
  for (uint32_t v = 0; v < hull.vertices.size(); ++v) {
    const auto same = std::ranges::find_if(corners, [&](uint32_t corner) {
      return (hull.vertices[corner] - hull.vertices[v]).norm() <= same_m;
    });
    corner_of[v] = same == corners.end() ? v : *same;
    if (same == corners.end()) corners.push_back(v);
  }
  return corner_of;
}

// The corners that span the face, counter-clockwise from outside (Andrew's monotone chain).
std::vector<uint32_t> loop_about(const HullFace& face, std::span<const uint32_t> corner_of,
                                 std::span<const Vec3> places) {
  const Vec3 along = face.normal.unitOrthogonal(), across = face.normal.cross(along);
  struct Point {
    double x, y;
    uint32_t corner;
    auto operator<=>(const Point&) const = default;
  };
  std::vector<Point> points;
  for (const uint32_t v : face.vertices) {
    const Vec3& place = places[corner_of[v]];
    points.push_back({along.dot(place), across.dot(place), corner_of[v]});
  }
  std::ranges::sort(points);
  points.erase(std::unique(points.begin(), points.end()), points.end());
  std::vector<Point> chain;
  const auto walk = [&](const std::vector<Point>& in_order) {
    const size_t first = chain.size();
    for (const Point& point : in_order) {
      const auto turns_left = [&] {
        const Point &from = chain[chain.size() - 2], &at = chain.back();
        return (at.x - from.x) * (point.y - from.y) - (at.y - from.y) * (point.x - from.x) > 0;
      };
      while (chain.size() >= first + 2 && !turns_left()) chain.pop_back();
      chain.push_back(point);
    }
    chain.pop_back();  // the next walk begins there
  };
  walk(points);
  walk(std::vector<Point>(points.rbegin(), points.rend()));
  std::vector<uint32_t> loop;
  for (const Point& point : chain) loop.push_back(point.corner);
  return loop;
}

// Vertices of no loop.
void drop_unused(std::vector<Vec3>& vertices, std::vector<uint32_t>& loops) {
  std::vector<uint32_t> number(vertices.size(), ConvexPiece::kNone);
  for (const uint32_t v : loops) number[v] = 0;
  uint32_t kept = 0;
  for (uint32_t v = 0; v < number.size(); ++v) {
    if (number[v] == ConvexPiece::kNone) continue;
    vertices[kept] = vertices[v];
    number[v] = kept++;
  }
  vertices.resize(kept);
  for (uint32_t& v : loops) v = number[v];
}

}  // namespace

ConvexPiece::ConvexPiece(const CollisionPiece& piece) {
  TriangleMesh mesh;
  switch (piece.kind) {
    case CollisionPiece::Kind::sphere:
      kind_ = Kind::sphere;
      radius_m_ = piece.size.x();
      take_vertices({piece.pose.position});
      measure();
      return;
    case CollisionPiece::Kind::round:
      make_round(piece);
      return;
    case CollisionPiece::Kind::box:
      mesh = box_mesh(piece.size);
      break;
    case CollisionPiece::Kind::hull:
      mesh = piece.hull;
      break;
  }
  const std::vector<uint32_t> corner_of = joined_corners(mesh);
  for (const HullFace& face : flat_faces(mesh)) {
    const std::vector<uint32_t> loop = loop_about(face, corner_of, mesh.vertices);
    if (loop.size() < 3) continue;
    const Vec3 normal = piece.pose.orientation * face.normal;
    faces_.push_back({normal, face.offset_m + normal.dot(piece.pose.position),
                      static_cast<uint32_t>(loops_.size()), static_cast<uint32_t>(loop.size())});
    loops_.insert(loops_.end(), loop.begin(), loop.end());
  }
  drop_unused(mesh.vertices, loops_);
  for (Vec3& vertex : mesh.vertices) vertex = piece.pose.apply(vertex);
  take_vertices(std::move(mesh.vertices));
  measure();
  map_faces();
}

void ConvexPiece::make_round(const CollisionPiece& piece) {
  kind_ = Kind::round;
  sector_ = piece.round;
  radius_m_ = sector_.margin;
  foot_ = piece.pose.position;
  sector_turn_ = piece.pose.orientation.toRotationMatrix();
  SectorFaces flat = flat_faces(sector_, 2 * kPi / kRimPoints);
  for (Vec3& corner : flat.corners) corner = piece.pose.apply(corner);
  // A face of the core has no points of contact where there is a margin.
  if (radius_m_ > 0) flat.loops.clear();
  for (const std::vector<uint32_t>& loop : flat.loops) {
    const Vec3& corner = flat.corners[loop[0]];
    const Vec3 along = flat.corners[loop[1]] - corner, across = flat.corners[loop.back()] - corner;
    const Vec3 normal = along.cross(across).normalized();
    faces_.push_back({normal, normal.dot(corner), static_cast<uint32_t>(loops_.size()),
                      static_cast<uint32_t>(loop.size())});
    loops_.insert(loops_.end(), loop.begin(), loop.end());
  }
  take_vertices(std::move(flat.corners));
  Bounds own;  // in the sector's frame
  for (int k = 0; k < 3; ++k) {
    for (const double side : {1.0, -1.0}) {
      const Vec3 along = side * Vec3::Unit(k);
      own.extend(Vec3(sector_.farthest(along) + radius_m_ * along));
      box_.extend(Vec3(farthest(along) + radius_m_ * along));
    }
  }
  smallest_extent_m_ = own.sizes().minCoeff();
  centre_ = foot_ + sector_turn_ * own.center();
  map_faces();
}

ConvexPiece::ConvexPiece(const std::array<Vec3, 3>& corners) {
  faces_ = {{Vec3::UnitY(), 0, 0, 3}, {Vec3::UnitY(), 0, 3, 3}};
  loops_ = {0, 1, 2, 0, 2, 1};
  take_vertices({corners[0], corners[1], corners[2]});
  map_faces();
  become(corners);
}

void ConvexPiece::become(const std::array<Vec3, 3>& corners) {
  const Vec3 normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).stableNormalized();
  faces_[0].normal = normal;
  faces_[0].offset_m = normal.dot(corners[0]);
  faces_[1].normal = -normal;
  faces_[1].offset_m = -faces_[0].offset_m;
  std::ranges::copy(corners, vertices_.begin());
  fill_blocks(vertices_, vertex_blocks_);
  fill_blocks(std::array{normal, Vec3(-normal)}, normal_blocks_);
  box_.setEmpty();
  measure();
  smallest_extent_m_ = std::numeric_limits<double>::infinity();
  inner_radius_m_ = 0;
  find_sides();
}

void ConvexPiece::take_vertices(std::vector<Vec3> vertices) {
  vertices_ = std::move(vertices);
  fill_blocks(vertices_, vertex_blocks_);
}

void ConvexPiece::measure() {
  for (const Vec3& vertex : vertices_) box_.extend(vertex);
  box_.min().array() -= radius_m_;
  box_.max().array() += radius_m_;
  centre_ = box_.center();
  smallest_extent_m_ = box_.sizes().minCoeff();
}

void ConvexPiece::map_faces() {
  inner_radius_m_ = std::numeric_limits<double>::infinity();
  for (const Face& face : faces_) {
    inner_radius_m_ = std::min(inner_radius_m_, face.offset_m - face.normal.dot(centre_));
  }
  if (kind_ == Kind::round) {
    const double aside = (centre_ - foot_).norm();
    const double across = std::hypot(sector_.height, sector_.bottom - sector_.top);
    inner_radius_m_ =
        faces_.empty()
            ? 0
            : std::min(inner_radius_m_, (sector_.radius_at(0) - aside) * sector_.height / across);
  }
  inner_radius_m_ = std::max(inner_radius_m_, 0.0);
  find_sides();
  std::vector<Vec3> normals;
  for (const Face& face : faces_) normals.push_back(face.normal);
  fill_blocks(normals, normal_blocks_);
  std::vector<std::vector<uint32_t>> at(vertices_.size());
  for (uint32_t f = 0; f < faces_.size(); ++f) {
    for (uint32_t i = 0; i < faces_[f].count; ++i) at[loops_[faces_[f].first + i]].push_back(f);
  }
  first_face_of_.push_back(0);
  for (const std::vector<uint32_t>& faces : at) {
    faces_of_.insert(faces_of_.end(), faces.begin(), faces.end());
    first_face_of_.push_back(static_cast<uint32_t>(faces_of_.size()));
  }
}

void ConvexPiece::find_sides() {
  sides_.resize(loops_.size());
  for (const Face& face : faces_) {
    for (uint32_t i = 0; i < face.count; ++i) {
      const Vec3& corner = vertices_[loops_[face.first + i]];
      const Vec3& next = vertices_[loops_[face.first + (i + 1 < face.count ? i + 1 : 0)]];
      const Vec3 normal = (next - corner).cross(face.normal);
      sides_[face.first + i] = {normal, normal.dot(corner)};
    }
  }
}

uint32_t ConvexPiece::farthest_vertex(const Vec3& direction) const {
  return greatest(vertex_blocks_, direction);
}

void ConvexPiece::list_beyond(const Vec3& direction, double least_m,
                              std::vector<uint32_t>& vertices) const {
  constexpr double kRounding = 1e-6;
  const double size_m = box_.min().cwiseAbs().cwiseMax(box_.max().cwiseAbs()).sum();
  const Lanes<float> least(static_cast<float>(least_m - kRounding * size_m));
  vertices.clear();
  for (size_t at = 0; at < vertex_blocks_.size(); at += 3 * kVertexLanes) {
    uint8_t lanes = 0;
    hn::StoreMaskBits(Lanes<float>::Tag(), product(vertex_blocks_.data() + at, direction) > least,
                      &lanes);
    for (; lanes != 0; lanes &= static_cast<uint8_t>(lanes - 1)) {
      const size_t vertex = at / 3 + static_cast<size_t>(std::countr_zero(lanes));
      if (vertex < vertices_.size()) vertices.push_back(static_cast<uint32_t>(vertex));
    }
  }
}

Vec3 ConvexPiece::farthest(const Vec3& direction) const {
  switch (kind_) {
    case Kind::sphere:
      return vertices_[0];
    case Kind::round:
      return foot_ + sector_turn_ * sector_.farthest(sector_turn_.transpose() * direction);
    case Kind::polytope:
      break;
  }
  return vertices_[farthest_vertex(direction)];
}

std::optional<ConvexPiece::RoundSide> ConvexPiece::round_side(const Vec3& direction) const {
  const Vec3 own = sector_turn_.transpose() * direction;
  const double across = std::hypot(own.x(), own.z());
  if (!(across > kAlongAxis * std::abs(own.y())) || !sector_.is_within(own)) return {};
  const auto point = [&](double radius, double y) {
    return Vec3(foot_ +
                sector_turn_ * Vec3(radius * own.x() / across, y, radius * own.z() / across));
  };
  return RoundSide{point(sector_.bottom, -sector_.height / 2),
                   point(sector_.top, sector_.height / 2), sector_turn_ * sector_.side_normal(own)};
}

bool ConvexPiece::is_covered(const Vec3& outward) const {
  if (kind_ != Kind::round || sector_.is_whole()) return false;
  const Vec3 own = sector_turn_.transpose() * outward;
  return std::abs(own.y()) < exact_constants::kFacing && own.x() > 0 && !sector_.is_within(own);
}

Vec3 ConvexPiece::to_arc(const Vec3& outward) const {
  const Vec3 own = sector_turn_.transpose() * outward;
  const double across = std::hypot(own.x(), own.z());
  return sector_turn_ *
         Vec3(across * sector_.end_x, own.y(), std::copysign(across * sector_.end_z, own.z()));
}

bool ConvexPiece::holds(const Vec3& point, double tolerance_m) const {
  if (kind_ == Kind::sphere) return (point - centre_).norm() <= radius_m_ + tolerance_m;
  if (kind_ == Kind::round) {
    const Vec3 at = sector_turn_.transpose() * (point - foot_);
    const double across = std::hypot(at.x(), at.z()), beyond = across - sector_.radius_at(at.y());
    if (radius_m_ > 0) {
      return sector_.is_within(at) && std::hypot(beyond, at.y()) <= radius_m_ + tolerance_m;
    }
    if (beyond > tolerance_m) return false;
  }
  return std::ranges::all_of(faces_, [&](const Face& face) {
    return face.normal.dot(point) <= face.offset_m + tolerance_m;
  });
}

uint32_t ConvexPiece::face_along(const Vec3& direction) const {
  return faces_.empty() ? kNone : greatest(normal_blocks_, direction);
}

uint32_t ConvexPiece::face_at(uint32_t vertex, const Vec3& direction) const {
  uint32_t best = kNone;
  double most = -2;
  for (uint32_t i = first_face_of_[vertex]; i < first_face_of_[vertex + 1]; ++i) {
    const double along = faces_[faces_of_[i]].normal.dot(direction);
    if (along > most) {
      most = along;
      best = faces_of_[i];
    }
  }
  return best;
}

}  // namespace pilesim::exact
