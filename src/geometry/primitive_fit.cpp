#include "geometry/primitive_fit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "core/rotation.h"
#include "geometry/convex_hull.h"
#include "geometry/hull_faces.h"
#include "geometry/mass_properties.h"

namespace pilesim {
namespace {

using Kind = FittedPrimitive::Kind;
using Point2 = Eigen::Vector2d;

constexpr double kOfCorners = 1e-3;  // of the smallest extent
constexpr double kOfFaces = 0.01;    // of the diameter
constexpr size_t kMostNormals = 24;  // of faces that are tried as a base
constexpr double kOnRim = 0.999;     // of a radius: points farther in are no part of a circle
constexpr int kMostFits = 60;        // of a circle, until only its rim is left

// The normals of a hull's largest faces in falling order of area.
std::vector<Vec3> large_faces(const TriangleMesh& hull) {
  std::vector<Vec3> normals;
  std::map<std::array<long, 3>, Vec3> doubled_areas;  // of faces that look the same way
  for (const auto& [a, b, c] : hull.triangles) {
    const Vec3& corner = hull.vertices[a];
    const Vec3 doubled = (hull.vertices[b] - corner).cross(hull.vertices[c] - corner);
    const Vec3 normal = doubled.stableNormalized();
    if (normal.isZero()) continue;
    std::array<long, 3> key;
    for (int k = 0; k < 3; ++k) key[static_cast<size_t>(k)] = std::lround(1e4 * normal[k]);
    doubled_areas.try_emplace(key, Vec3::Zero()).first->second += doubled;
  }
  for (const auto& [key, doubled] : doubled_areas) normals.push_back(doubled);
  std::ranges::stable_sort(normals, std::ranges::greater{},
                           [](const Vec3& doubled) { return doubled.squaredNorm(); });
  if (normals.size() > kMostNormals) normals.resize(kMostNormals);
  for (Vec3& normal : normals) normal.normalize();
  return normals;
}

// Distances along the axis and from it.
struct AxisProfile {
  double along, out;
};

double distance_to_segment(const AxisProfile& from, const AxisProfile& a, const AxisProfile& b) {
  const Point2 start(a.along, a.out), way = Point2(b.along, b.out) - start;
  const Point2 offset = Point2(from.along, from.out) - start;
  const double share = std::clamp(offset.dot(way) / way.squaredNorm(), 0.0, 1.0);
  return (offset - share * way).norm();
}

// From the surface of a box about the origin, inside or outside.
template <class Vector>
double distance_to_box(const Vector& point, const Vector& half) {
  const Vector beyond = point.cwiseAbs() - half;
  return beyond.maxCoeff() < 0 ? -beyond.maxCoeff() : beyond.cwiseMax(0).norm();
}

// Distance of a point in the primitive's own frame from its surface, m.
double distance_to(const FittedPrimitive& primitive, const Vec3& point) {
  const double r = primitive.size.x(), half = primitive.size.y() / 2;
  const AxisProfile profile{point.y(), std::hypot(point.x(), point.z())};
  switch (primitive.kind) {
    case Kind::ball:
      return std::abs(point.norm() - r);
    case Kind::box:
      return distance_to_box<Vec3>(point, primitive.size / 2);
    case Kind::cylinder:
      return distance_to_box<Point2>({profile.out, profile.along}, {r, half});
    case Kind::cone:
      return std::min(distance_to_segment(profile, {-half, 0}, {-half, r}),
                      distance_to_segment(profile, {-half, r}, {half, 0}));
    case Kind::capsule: {
      const double beyond = std::max(0.0, std::abs(profile.along) - (half - r));
      return std::abs(std::hypot(beyond, profile.out) - r);
    }
  }
  return 0;
}

// How far it reaches along a unit vector in its own frame, m.
double reach_along(const FittedPrimitive& primitive, const Vec3& normal) {
  const double r = primitive.size.x(), half = primitive.size.y() / 2;
  const double out = std::hypot(normal.x(), normal.z());
  switch (primitive.kind) {
    case Kind::ball:
      return r;
    case Kind::box:
      return (primitive.size / 2).dot(normal.cwiseAbs());
    case Kind::cylinder:
      return half * std::abs(normal.y()) + r * out;
    case Kind::cone:
      return std::max(half * normal.y(), r * out - half * normal.y());
    case Kind::capsule:
      return (half - r) * std::abs(normal.y()) + r;
  }
  return 0;
}

// A circle through points, by least squares (Kasa 1976); those well inside of it are left out.
struct Circle {
  Point2 centre = Point2::Zero();
  double radius = 0;
};

Circle circle_of(std::vector<Point2> points) {
  Circle circle;
  for (int round = 0; round < kMostFits; ++round) {
    Point2 middle = Point2::Zero();
    for (const Point2& p : points) middle += p;
    middle /= static_cast<double>(points.size());
    Mat3 normal_matrix = Mat3::Zero();
    Vec3 right = Vec3::Zero();
    for (const Point2& p : points) {
      const Point2 at = p - middle;
      const Vec3 row(at.x(), at.y(), 1);
      normal_matrix += row * row.transpose();
      right += at.squaredNorm() * row;
    }
    const Vec3 solved = normal_matrix.ldlt().solve(right);
    circle.centre = middle + solved.head<2>() / 2;
    circle.radius = std::sqrt(std::max(0.0, solved.z() + solved.head<2>().squaredNorm() / 4));
    const auto inside = [&](const Point2& p) {
      return (p - circle.centre).norm() < kOnRim * circle.radius;
    };
    if (std::erase_if(points, inside) == 0 || points.size() < 3) break;
  }
  return circle;
}

class Fitter {
 public:
  explicit Fitter(const TriangleMesh& mesh)
      : hull_(convex_hull(mesh.vertices)),
        mass_(mass_properties(hull_)),
        rounding_m_(mesh.rounding_m) {}

  std::optional<FittedPrimitive> fit() {
    if (is_it(ball())) return found_;
    large_ = large_faces(hull_);
    const Mat3 principal = principal_inertia(mass_.inertia_m5).axes.toRotationMatrix();
    // The ends of a rod are smaller than all of its sides.
    std::vector<Vec3> bases = large_;
    for (int k = 0; k < 3; ++k) {
      for (const double side : {1.0, -1.0}) {
        const Vec3 axis = side * principal.col(k);
        bases.push_back(std::ranges::max(faces(), {}, [&](const HullFace& face) {
                          return face.normal.dot(axis);
                        }).normal);
      }
    }
    for (const Vec3& up : bases) {
      if (is_it(box(up)) || is_it(standing(Kind::cylinder, up)) ||
          is_it(standing(Kind::cone, -up))) {
        return found_;
      }
    }
    for (int k = 0; k < 3; ++k) {
      if (is_it(standing(Kind::capsule, principal.col(k)))) return found_;
    }
    return std::nullopt;
  }

 private:
  // Made when they are first asked for: a candidate whose corners lie elsewhere needs none.
  const std::vector<HullFace>& faces() {
    if (faces_.empty()) faces_ = flat_faces(hull_);
    return faces_;
  }

  FittedPrimitive ball() const {
    const Vec3 middle = mass_.centre_of_mass;
    Eigen::Matrix4d normal_matrix = Eigen::Matrix4d::Zero();
    Eigen::Vector4d right = Eigen::Vector4d::Zero();
    for (const Vec3& vertex : hull_.vertices) {
      const Vec3 at = vertex - middle;
      const Eigen::Vector4d row(at.x(), at.y(), at.z(), 1);
      normal_matrix += row * row.transpose();
      right += at.squaredNorm() * row;
    }
    const Eigen::Vector4d solved = normal_matrix.ldlt().solve(right);
    const Vec3 offset = solved.head<3>() / 2;
    const double radius = std::sqrt(std::max(0.0, solved.w() + offset.squaredNorm()));
    return {
        .kind = Kind::ball, .pose = {.position = middle + offset}, .size = Vec3::Constant(radius)};
  }

  // Between the least and the most along each axis of `turn`.
  Bounds bounds_along(const Quat& turn) const {
    Bounds bounds;
    for (const Vec3& vertex : hull_.vertices) bounds.extend(turn.conjugate() * vertex);
    return bounds;
  }

  // With a face that looks to `up`, and beside it the largest one at a right angle.
  FittedPrimitive box(const Vec3& up) const {
    constexpr double kRight = 1e-3;
    const auto beside = std::ranges::find_if(
        large_, [&](const Vec3& other) { return std::abs(other.dot(up)) < kRight; });
    Vec3 along = beside == large_.end() ? up.unitOrthogonal() : *beside;
    along = (along - along.dot(up) * up).normalized();
    Mat3 axes;
    axes << along, up, along.cross(up);
    const Quat turn(axes);
    const Bounds bounds = bounds_along(turn);
    return {.kind = Kind::box, .pose = {turn * bounds.center(), turn}, .size = bounds.sizes()};
  }

  // Round about an axis that points to `up`.
  FittedPrimitive standing(Kind kind, const Vec3& up) const {
    const Quat turn = rotation_between(Vec3::UnitY(), up);
    const Bounds bounds = bounds_along(turn);
    std::vector<Point2> rim;
    for (const Vec3& vertex : hull_.vertices) {
      const Vec3 at = turn.conjugate() * vertex;
      rim.emplace_back(at.x(), at.z());
    }
    const Circle circle = circle_of(std::move(rim));
    const double height = bounds.sizes().y();
    const Vec3 middle(circle.centre.x(), bounds.center().y(), circle.centre.y());
    return {.kind = kind,
            .pose = {turn * middle, turn},
            .size = {circle.radius, height, circle.radius}};
  }

  bool is_it(FittedPrimitive candidate) {
    const double round_m = 2 * candidate.size.x();
    const bool is_box = candidate.kind == Kind::box;
    const double smallest =
        is_box ? candidate.size.minCoeff() : std::min(round_m, candidate.size.y());
    if (!(smallest > 0) || !candidate.size.allFinite()) return false;
    const double off_m = kOfCorners * (candidate.kind == Kind::ball ? round_m : smallest);
    const double corners_m = off_m + std::min(off_m, rounding_m_);
    if (candidate.kind == Kind::capsule && candidate.size.y() < round_m) return false;
    to_centre_of_mass(candidate, corners_m);
    const Quat back = candidate.pose.orientation.conjugate();
    double worst = 0;
    for (const Vec3& vertex : hull_.vertices) {
      const double distance = distance_to(candidate, back * (vertex - candidate.pose.position));
      if (!(distance <= corners_m)) return false;
      worst = std::max(worst, distance);
    }
    for (const HullFace& face : faces()) {
      const Vec3 normal = back * face.normal;
      const double below =
          reach_along(candidate, normal) + face.normal.dot(candidate.pose.position) - face.offset_m;
      if (is_askew(candidate, normal, corners_m) ||
          !(below <= (is_box ? corners_m : kOfFaces * round_m + corners_m))) {
        return false;
      }
      worst = std::max(worst, below);
    }
    candidate.surface_error_m = worst;
    found_ = candidate;
    return true;
  }

  // A side that tapers or a base that slants, by more than corners may be off: that is no matter of
  // how finely it is divided.
  static bool is_askew(const FittedPrimitive& candidate, const Vec3& normal, double corners_m) {
    constexpr double kSide = 0.5, kBase = 0.9;  // |cosine| to the axis; between them is a bevel
    const bool is_cylinder = candidate.kind == Kind::cylinder;
    if (!is_cylinder && candidate.kind != Kind::cone) return false;
    const double along = std::abs(normal.y()), out = std::hypot(normal.x(), normal.z());
    if (is_cylinder && along < kSide) return along * candidate.size.y() > 2 * corners_m;
    const bool is_base = along > kBase && (is_cylinder || normal.y() < 0);
    return is_base && out * 2 * candidate.size.x() > 2 * corners_m;
  }

  // So that it does not roll to one side by the way its mesh is divided.
  void to_centre_of_mass(FittedPrimitive& candidate, double most_m) const {
    if (candidate.kind == Kind::cone) return;
    const Vec3 offset = mass_.centre_of_mass - candidate.pose.position;
    if (offset.norm() <= most_m) candidate.pose.position += offset;
  }

  TriangleMesh hull_;
  MassProperties mass_;  // of the hull
  std::vector<HullFace> faces_;
  std::vector<Vec3> large_;  // normals of the largest
  double rounding_m_;
  FittedPrimitive found_{};
};

}  // namespace

double FittedPrimitive::volume_m3() const {
  const double r = size.x(), height = size.y();
  switch (kind) {
    case Kind::ball:
      return 4 * kPi / 3 * r * r * r;
    case Kind::box:
      return size.prod();
    case Kind::cylinder:
      return kPi * r * r * height;
    case Kind::cone:
      return kPi * r * r * height / 3;
    case Kind::capsule:
      return kPi * r * r * (height - 2 * r) + 4 * kPi / 3 * r * r * r;
  }
  return 0;
}

std::optional<FittedPrimitive> fit_primitive(const TriangleMesh& mesh) {
  return Fitter(mesh).fit();
}

}  // namespace pilesim
