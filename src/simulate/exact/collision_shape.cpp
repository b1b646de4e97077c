#include "simulate/exact/collision_shape.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "geometry/mass_properties.h"

namespace pilesim::exact {
namespace {

// Products of inertia below this share of the trace are rounding: such a body keeps its own axes.
constexpr double kDiagonalShare = 1e-9;
// A point this near to an edge, as a share of the triangle's longest side, lies on it.
constexpr double kOnEdge = 1e-3;

bool is_diagonal(const Mat3& inertia) {
  const double limit = kDiagonalShare * inertia.trace();
  return std::abs(inertia(0, 1)) <= limit && std::abs(inertia(0, 2)) <= limit &&
         std::abs(inertia(1, 2)) <= limit;
}

// For each vertex one with the same place: files may have a vertex of its own for each face.
std::vector<uint32_t> first_at_same_place(const std::vector<Vec3>& vertices) {
  std::vector<uint32_t> order(vertices.size()), first(vertices.size());
  std::iota(order.begin(), order.end(), 0u);
  const auto place = [&](uint32_t v) {
    return std::array{vertices[v].x(), vertices[v].y(), vertices[v].z()};
  };
  std::ranges::sort(order, {}, place);
  for (size_t i = 0; i < order.size(); ++i) {
    const bool is_same = i > 0 && place(order[i]) == place(order[i - 1]);
    first[order[i]] = is_same ? first[order[i - 1]] : order[i];
  }
  return first;
}

// The triangles by their edges.
class EdgeOwners {
 public:
  explicit EdgeOwners(const TriangleMesh& mesh)
      : place_(first_at_same_place(mesh.vertices)),
        begin_(mesh.vertices.size() + 1),
        ends_(3 * mesh.triangles.size()) {
    for (const Triangle& triangle : mesh.triangles) {
      for (const uint32_t vertex : triangle) ++begin_[place_[vertex] + 1];
    }
    std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
    std::vector<uint32_t> next(begin_.begin(), begin_.end() - 1);
    for (uint32_t t = 0; t < mesh.triangles.size(); ++t) {
      for (size_t k = 0; k < 3; ++k) {
        const Triangle& triangle = mesh.triangles[t];
        ends_[next[place_[triangle[k]]]++] = {place_[triangle[(k + 1) % 3]], t};
      }
    }
    for (size_t v = 0; v + 1 < begin_.size(); ++v) {
      std::sort(ends_.begin() + begin_[v], ends_.begin() + begin_[v + 1]);
    }
  }

  // The last triangle that has the edge from that vertex to the other, or kNone.
  static constexpr uint32_t kNone = ~uint32_t{0};
  uint32_t of(uint32_t from, uint32_t to) const {
    const auto begin = ends_.begin() + begin_[place_[from]];
    const auto found = std::upper_bound(begin, ends_.begin() + begin_[place_[from] + 1],
                                        std::pair(place_[to], kNone));
    return found == begin || (found - 1)->first != place_[to] ? kNone : (found - 1)->second;
  }

 private:
  std::vector<uint32_t> place_;                      // by vertex
  std::vector<uint32_t> begin_;                      // by vertex, in ends_
  std::vector<std::pair<uint32_t, uint32_t>> ends_;  // of edges, and their triangles
};

}  // namespace

Vec3 out_of(const Vec3& normal, std::span<const Vec3> constraints) {
  constexpr double kRounding = 1e-9;
  Vec3 best = Vec3::Zero();
  const auto consider = [&](const Vec3& candidate) {
    if (candidate.squaredNorm() <= best.squaredNorm()) return;
    for (const Vec3& into : constraints) {
      if (candidate.dot(into) > kRounding) return;
    }
    best = candidate;
  };
  consider(normal);
  for (const Vec3& into : constraints) consider(normal - normal.dot(into) * into);
  for (size_t i = 0; i < constraints.size(); ++i) {
    for (size_t j = 0; j < i; ++j) {
      const Vec3 along = constraints[i].cross(constraints[j]);
      const double length2 = along.squaredNorm();
      if (length2 > kRounding) consider(normal.dot(along) / length2 * along);
    }
  }
  return best;
}

TriangleSurface::TriangleSurface(const TriangleMesh& mesh, bool solid_behind)
    : tree_(mesh), solid_behind_(solid_behind) {
  const auto normal_of = [&](const Triangle& t) {
    return Vec3((mesh.vertices[t[1]] - mesh.vertices[t[0]])
                    .cross(mesh.vertices[t[2]] - mesh.vertices[t[0]])
                    .stableNormalized());
  };
  const std::vector<uint32_t>& triangles = tree_.triangles();
  std::vector<uint32_t> place_of(triangles.size());
  normals_.reserve(triangles.size());
  for (uint32_t place = 0; place < triangles.size(); ++place) {
    place_of[triangles[place]] = place;
    normals_.push_back(normal_of(mesh.triangles[triangles[place]]));
  }
  const EdgeOwners owners(mesh);
  edges_.resize(triangles.size());
  for (uint32_t place = 0; place < triangles.size(); ++place) {
    const Triangle& triangle = mesh.triangles[triangles[place]];
    for (size_t k = 0; k < 3; ++k) {
      const uint32_t other = owners.of(triangle[(k + 1) % 3], triangle[k]);
      edges_[place].over[k] = other == EdgeOwners::kNone ? place : place_of[other];
      if (other == EdgeOwners::kNone) {
        is_closed_ = false;
        edges_[place].ridge[k] = kBorder;
        continue;
      }
      const Corners& corners = tree_.corners()[place];
      const Vec3 side = corners[(k + 1) % 3] - corners[k];
      const double bend = normals_[place].cross(normals_[place_of[other]]).dot(side);
      edges_[place].ridge[k] = static_cast<int8_t>(bend > 0 ? 1 : bend < 0 ? -1 : 0);
    }
  }
}

bool TriangleSurface::is_below(const Vec3& point) const {
  Bounds column(point, point);
  column.max().y() = std::numeric_limits<double>::infinity();
  bool is_below = false;
  tree_.for_each_near(column, 0, [&](uint32_t place) {
    const Face face = this->face(place);
    bool is_over = face.normal.dot(point - face.corners[0]) < 0;
    for (size_t k = 0; k < 3; ++k) {
      const Vec3 edge = face.corners[(k + 1) % 3] - face.corners[k];
      is_over = is_over && Vec3::UnitY().cross(edge).dot(point - face.corners[k]) >= 0;
    }
    is_below = is_below || is_over;
  });
  return is_below;
}

Vec3 TriangleSurface::allowed(uint32_t place, int side, const Vec3& point,
                              const Vec3& normal) const {
  const Face face = this->face(place);
  const Edges& edges = edges_[place];
  const Vec3 own = side * face.normal;
  Vec3 best = own;
  double most = own.dot(normal);
  double longest = 0;
  for (size_t k = 0; k < 3; ++k) {
    longest = std::max(longest, (face.corners[(k + 1) % 3] - face.corners[k]).norm());
  }
  for (size_t k = 0; k < 3; ++k) {
    const Vec3 edge = face.corners[(k + 1) % 3] - face.corners[k];
    const Vec3 inward = face.normal.cross(edge).normalized();
    if (inward.dot(point - face.corners[k]) > kOnEdge * longest) continue;
    const bool is_border = edges.ridge[k] == kBorder;
    if (edges.ridge[k] != side && !is_border) continue;
    // Between the two normals. Beyond a border lies the way out, in the face's plane.
    const Vec3 other = is_border ? Vec3(-inward) : Vec3(side * normals_[edges.over[k]]);
    const double cosine = own.dot(other);
    const Vec3 towards = other - cosine * own;
    const double sine = towards.norm();
    if (sine < 1e-9) continue;
    const double along = normal.dot(own), across = normal.dot(towards) / sine;
    if (across <= 0) continue;
    const double taken = std::min(std::atan2(across, along), std::atan2(sine, cosine));
    const Vec3 candidate = std::cos(taken) * own + std::sin(taken) / sine * towards;
    const double agrees = candidate.dot(normal);
    if (agrees > most) {
      most = agrees;
      best = candidate.normalized();
    }
  }
  for (size_t k = 0; k < 3; ++k) {
    if ((point - face.corners[k]).norm() > kOnEdge * longest) continue;
    Vec3 candidate = off_vertex(place, k, side, normal);
    if (candidate.dot(normal) > most) return candidate;
  }
  return best;
}

// The nearest to `normal` that leaves all triangles at a corner behind, as over a peak; zero: there
// is none.
Vec3 TriangleSurface::off_vertex(uint32_t place, size_t corner, int side,
                                 const Vec3& normal) const {
  constexpr size_t kMostTriangles = 256;  // an edge of more than two triangles has no end
  const Vec3& vertex = tree_.corners()[place][corner];
  thread_local std::vector<Vec3> into;
  into.clear();
  Vec3 outward = Vec3::Zero();
  bool is_closed = false;
  // Round the vertex across the edges that lead to it, and from a border on the other way.
  for (const size_t across : {2, 0}) {
    uint32_t at = place;
    size_t k = corner;
    while (into.size() < 2 * kMostTriangles) {
      const Corners& corners = tree_.corners()[at];
      if (across == 2 || at != place) {
        const Vec3 next = corners[(k + 1) % 3] - vertex, last = corners[(k + 2) % 3] - vertex;
        into.insert(into.end(), {next.normalized(), last.normalized()});
        outward += side * next.cross(last);
      }
      const size_t edge = (k + across) % 3;
      if (edges_[at].ridge[edge] == kBorder) {
        into.push_back(-side * normals_[at]);
        break;
      }
      at = edges_[at].over[edge];
      const Corners& beyond = tree_.corners()[at];
      k = static_cast<size_t>(std::ranges::find(beyond, vertex) - beyond.begin());
      is_closed = at == place;
      if (is_closed || k == beyond.size()) break;
    }
    if (is_closed) break;
  }
  const Vec3 off = out_of(normal, into);
  return off.dot(outward) > 0 ? Vec3(off.normalized()) : Vec3(Vec3::Zero());
}

CollisionShape::CollisionShape(const ModelShape& shape)
    : is_plane(shape.is_plane),
      radius_m(shape.bounding_radius),
      smallest_extent_m(shape.smallest_extent) {
  if (is_plane) return;
  if (shape.mass.volume_m3 > 0) {
    const Mat3 inertia = shape.mass.inertia_m5 / shape.mass.volume_m3;
    if (is_diagonal(inertia)) {
      moments = inertia.diagonal();
    } else {
      const PrincipalInertia principal = principal_inertia(inertia);
      moments = principal.moments;
      axes = principal.axes;
    }
  }
  if (shape.collides_as_mesh) {
    surface = LazySurface(shape.mesh, shape.solid_behind);
    box = shape.mesh.bounds();
    for (const Vec3& vertex : shape.mesh.vertices) radius_m = std::max(radius_m, vertex.norm());
    turning_radius_m = radius_m;
    return;
  }
  piece_extent_m = std::numeric_limits<double>::infinity();
  radius_m = 0;
  for (const CollisionPiece& piece : shape.pieces) {
    pieces.emplace_back(piece);
    const ConvexPiece& made = pieces.back();
    box.extend(made.box());
    piece_extent_m = std::min(piece_extent_m, made.smallest_extent_m());
    for (const Vec3& vertex : made.vertices()) {
      radius_m = std::max(radius_m, vertex.norm() + made.radius_m());
    }
  }
  constexpr double kCentred = 1e-6;  // of its radius
  const bool is_ball = pieces.size() == 1 && pieces[0].kind() == ConvexPiece::Kind::sphere &&
                       pieces[0].centre().norm() <= kCentred * radius_m;
  turning_radius_m = is_ball ? 0 : radius_m;
}

}  // namespace pilesim::exact
