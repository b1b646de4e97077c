#include "simulate/exact/collision_shape.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

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

}  // namespace

TriangleSurface::TriangleSurface(const TriangleMesh& mesh, bool solid_behind)
    : tree_(mesh), solid_behind_(solid_behind) {
  const auto normal_of = [&](const Triangle& t) {
    return Vec3((mesh.vertices[t[1]] - mesh.vertices[t[0]])
                    .cross(mesh.vertices[t[2]] - mesh.vertices[t[0]])
                    .stableNormalized());
  };
  // Edges by the places of their ends: files may have a vertex of its own for each face.
  using Point = std::array<double, 3>;
  const auto key = [&](uint32_t v) {
    return Point{mesh.vertices[v].x(), mesh.vertices[v].y(), mesh.vertices[v].z()};
  };
  std::map<std::pair<Point, Point>, uint32_t> owner;
  for (uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    for (size_t k = 0; k < 3; ++k) {
      owner[{key(mesh.triangles[t][k]), key(mesh.triangles[t][(k + 1) % 3])}] = t;
    }
  }
  std::vector<uint32_t> place_of(mesh.triangles.size());
  for (uint32_t place = 0; place < tree_.triangles().size(); ++place) {
    place_of[tree_.triangles()[place]] = place;
  }
  for (uint32_t place = 0; place < tree_.triangles().size(); ++place) {
    const Triangle& triangle = mesh.triangles[tree_.triangles()[place]];
    Face face{tree_.corners()[place], normal_of(triangle), {}};
    for (size_t k = 0; k < 3; ++k) {
      face.over[k] = face.normal;
      const auto over = owner.find({key(triangle[(k + 1) % 3]), key(triangle[k])});
      if (over == owner.end()) {
        is_closed_ = false;
        face.over[k] =
            (face.corners[(k + 1) % 3] - face.corners[k]).cross(face.normal).stableNormalized();
        face.ridge[k] = kBorder;
        continue;
      }
      const Triangle& other = mesh.triangles[over->second];
      face.neighbour[k] = place_of[over->second];
      const Vec3 side = face.corners[(k + 1) % 3] - face.corners[k];
      const Vec3 normal = normal_of(other);
      face.over[k] = normal;
      const double bend = face.normal.cross(normal).dot(side);
      face.ridge[k] = static_cast<int8_t>(bend > 0 ? 1 : bend < 0 ? -1 : 0);
    }
    faces_.push_back(face);
  }
}

Vec3 TriangleSurface::allowed(uint32_t place, int side, const Vec3& point,
                              const Vec3& normal) const {
  const Face& face = faces_[place];
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
    const bool is_border = face.ridge[k] == kBorder && !solid_behind_;
    if (face.ridge[k] != side && !is_border) continue;
    // Between the two normals.
    const Vec3 other = is_border ? face.over[k] : Vec3(side * face.over[k]);
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
  return best;
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
}

}  // namespace pilesim::exact
