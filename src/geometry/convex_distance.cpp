#include "geometry/convex_distance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <vector>

namespace pilesim {
namespace {

// Both in extents of the Minkowski difference: bounds that are so close are one; smaller
// differences are rounding.
constexpr double kConverged = 1e-12;
constexpr double kRounding = 1e-14;
constexpr int kMostSteps = 256;  // curved bodies stop here at the latest
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Points a - b with a and b in the cores; the distance of the cores is that of this set from zero.
class Difference {
 public:
  Difference(const ConvexBody& a, const ConvexBody& b) : a_(a), b_(b) {}
  Vec3 farthest(const Vec3& direction) {
    Vec3 point = a_.farthest(direction) - b_.farthest(-direction);
    extent_m_ = std::max(extent_m_, point.norm());
    return point;
  }
  double extent_m() const { return extent_m_; }  // of the points so far, from zero

 private:
  const ConvexBody& a_;
  const ConvexBody& b_;
  double extent_m_ = 0;
};

// Some corners of the difference, and the point of their hull that is nearest to zero.
struct Simplex {
  std::array<Vec3, 4> corners;
  int size = 0;
  Vec3 nearest = Vec3::Zero();
  bool holds_zero = false;

  void set(std::initializer_list<Vec3> points, const Vec3& nearest_point) {
    size = 0;
    for (const Vec3& point : points) corners[static_cast<size_t>(size++)] = point;
    nearest = nearest_point;
  }
};

Simplex nearest_of(const Vec3& a) {
  Simplex simplex;
  simplex.set({a}, a);
  return simplex;
}

Simplex nearest_of(const Vec3& a, const Vec3& b) {
  const Vec3 along = b - a;
  const double t = -a.dot(along), length2 = along.squaredNorm();
  if (t <= 0 || length2 == 0) return nearest_of(a);
  if (t >= length2) return nearest_of(b);
  Simplex simplex;
  simplex.set({a, b}, a + (t / length2) * along);
  return simplex;
}

bool is_nearer(const Simplex& one, const Simplex& other) {
  return one.nearest.squaredNorm() < other.nearest.squaredNorm();
}

Simplex nearest_of(const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 normal = (b - a).cross(c - a);
  const double area2 = normal.squaredNorm();
  // Barycentric coordinates of zero's projection onto the plane, by area2.
  const double at_a = normal.dot(b.cross(c)), at_b = normal.dot(c.cross(a)),
               at_c = normal.dot(a.cross(b));
  if (area2 > 0 && at_a > 0 && at_b > 0 && at_c > 0) {
    Simplex simplex;
    simplex.set({a, b, c}, (normal.dot(a) / area2) * normal);
    return simplex;
  }
  Simplex best = nearest_of(a, b);
  for (const Simplex& edge : {nearest_of(b, c), nearest_of(c, a)}) {
    if (is_nearer(edge, best)) best = edge;
  }
  return best;
}

Simplex nearest_of(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  const auto is_outside = [](const Vec3& p, const Vec3& q, const Vec3& r, const Vec3& inner) {
    const Vec3 normal = (q - p).cross(r - p);
    const double to_inner = normal.dot(inner - p);
    return to_inner == 0 || normal.dot(p) * to_inner >= 0;  // zero lies on the other side
  };
  std::optional<Simplex> best;
  const auto try_face = [&](const Vec3& p, const Vec3& q, const Vec3& r, const Vec3& inner) {
    if (!is_outside(p, q, r, inner)) return;
    const Simplex face = nearest_of(p, q, r);
    if (!best || is_nearer(face, *best)) best = face;
  };
  try_face(a, b, c, d);
  try_face(a, b, d, c);
  try_face(a, c, d, b);
  try_face(b, c, d, a);
  if (best) return *best;
  Simplex simplex;
  simplex.set({a, b, c, d}, Vec3::Zero());
  simplex.holds_zero = true;
  return simplex;
}

Simplex with(const Simplex& simplex, const Vec3& corner) {
  const auto& p = simplex.corners;
  switch (simplex.size) {
    case 1:
      return nearest_of(p[0], corner);
    case 2:
      return nearest_of(p[0], p[1], corner);
    default:
      return nearest_of(p[0], p[1], p[2], corner);
  }
}

// The faces of a polytope inside the difference, around zero.
class Polytope {
 public:
  // The corners of a tetrahedron.
  explicit Polytope(std::span<const Vec3> corners) : corners_(corners.begin(), corners.end()) {
    const double volume =
        (corners[1] - corners[0]).cross(corners[2] - corners[0]).dot(corners[3] - corners[0]);
    if (volume > 0) std::swap(corners_[1], corners_[2]);
    add_face(0, 1, 2);
    add_face(0, 3, 1);
    add_face(0, 2, 3);
    add_face(1, 3, 2);
  }

  struct Face {
    std::array<uint32_t, 3> corners;  // counter-clockwise from outside
    Vec3 normal;                      // unit, outward; zero where it has no area
    double distance_m;                // of its plane from zero
  };
  const Face& nearest() const {
    return *std::ranges::min_element(faces_, {}, [](const Face& face) { return face.distance_m; });
  }

  // Takes one more corner in. False where no face sees it, or where, by rounding, those that do are
  // no patch with a rim of its own: faces over such a rim would multiply without end.
  bool add(const Vec3& corner, double rounding_m) {
    rim_.clear();
    const auto seen = [&](const Face& face) {
      return face.normal.dot(corner - corners_[face.corners[0]]) > rounding_m;
    };
    for (const Face& face : faces_) {
      if (!seen(face)) continue;
      for (size_t i = 0; i < 3; ++i) cross(face.corners[i], face.corners[(i + 1) % 3]);
    }
    if (rim_.empty() || !is_simple(rim_)) return false;
    std::erase_if(faces_, seen);
    const auto index = static_cast<uint32_t>(corners_.size());
    corners_.push_back(corner);
    for (const auto& [from, to] : rim_) add_face(from, to, index);
    return true;
  }

 private:
  void add_face(uint32_t a, uint32_t b, uint32_t c) {
    Face face{.corners = {a, b, c}, .normal = Vec3::Zero(), .distance_m = kInfinity};
    const Vec3 normal = (corners_[b] - corners_[a]).cross(corners_[c] - corners_[a]);
    if (const double area = normal.norm(); area > 0) {
      face.normal = normal / area;
      face.distance_m = face.normal.dot(corners_[a]);
    }
    faces_.push_back(face);
  }
  // An edge between two faces that go is met twice, once in each direction, and is none of the rim.
  void cross(uint32_t from, uint32_t to) {
    const auto twin = std::ranges::find(rim_, std::array{to, from});
    if (twin == rim_.end()) {
      rim_.push_back({from, to});
    } else {
      rim_.erase(twin);
    }
  }

  // No corner is passed twice.
  static bool is_simple(const std::vector<std::array<uint32_t, 2>>& rim) {
    std::vector<uint32_t> corners;
    for (const auto& edge : rim) corners.push_back(edge[0]);
    std::ranges::sort(corners);
    return std::ranges::adjacent_find(corners) == corners.end();
  }

  std::vector<Vec3> corners_;
  std::vector<Face> faces_;
  std::vector<std::array<uint32_t, 2>> rim_;
};

// Makes a tetrahedron of a simplex that touches zero; false where the difference is flat.
bool make_solid(Difference& difference, Simplex& simplex) {
  auto& p = simplex.corners;
  const double flat_m = kConverged * difference.extent_m();
  const auto try_add = [&](const Vec3& direction, const auto& distance) {
    const Vec3 corner = difference.farthest(direction);
    if (distance(corner) <= flat_m) return false;
    p[static_cast<size_t>(simplex.size++)] = corner;
    return true;
  };
  const auto try_both = [&](const Vec3& direction, const auto& distance) {
    return try_add(direction, distance) || try_add(-direction, distance);
  };
  if (simplex.size == 1) {
    const auto from_point = [&](const Vec3& corner) { return (corner - p[0]).norm(); };
    for (int axis = 0; axis < 3 && simplex.size == 1; ++axis) {
      try_both(Vec3::Unit(axis), from_point);
    }
    if (simplex.size == 1) return false;
  }
  if (simplex.size == 2) {
    const Vec3 along = (p[1] - p[0]).normalized();
    const auto from_line = [&](const Vec3& corner) { return along.cross(corner - p[0]).norm(); };
    const Vec3 side = along.unitOrthogonal();
    if (!try_both(side, from_line) && !try_both(along.cross(side), from_line)) return false;
  }
  if (simplex.size == 3) {
    const Vec3 normal = (p[1] - p[0]).cross(p[2] - p[0]).normalized();
    const auto from_plane = [&](const Vec3& corner) { return std::abs(normal.dot(corner - p[0])); };
    if (!try_both(normal, from_plane)) return false;
  }
  return true;
}

// Depth of cores that overlap; `simplex` touches zero.
double depth_of_cores(Difference& difference, Simplex simplex) {
  if (!make_solid(difference, simplex)) return 0;
  Polytope polytope(simplex.corners);
  double depth_m = kInfinity;  // by which some direction parts them
  for (int step = 0; step < kMostSteps; ++step) {
    const Polytope::Face face = polytope.nearest();
    if (!std::isfinite(face.distance_m)) break;
    const Vec3 corner = difference.farthest(face.normal);
    depth_m = std::min(depth_m, face.normal.dot(corner));
    const double extent_m = difference.extent_m();
    if (depth_m - face.distance_m <= kConverged * extent_m) break;
    if (!polytope.add(corner, kRounding * extent_m)) break;
  }
  return std::max(depth_m, 0.0);
}

}  // namespace

double convex_distance(const ConvexBody& a, const ConvexBody& b, double reach_m) {
  Difference difference(a, b);
  const double radii_m = a.radius_m() + b.radius_m();
  Simplex simplex = nearest_of(difference.farthest(Vec3::UnitX()));
  for (int step = 0; step < kMostSteps; ++step) {
    const double distance_m = simplex.nearest.norm();
    if (distance_m <= kRounding * difference.extent_m()) {
      return -depth_of_cores(difference, simplex) - radii_m;
    }
    const Vec3 corner = difference.farthest(-simplex.nearest);
    const double least_m = simplex.nearest.dot(corner) / distance_m;
    if (least_m - radii_m > reach_m) return kInfinity;
    if (distance_m - least_m <= kConverged * difference.extent_m()) break;
    const Simplex next = with(simplex, corner);
    // A plane parts the cores: a flat tetrahedron on a curved one holds zero by rounding alone.
    const bool is_apart = least_m > kRounding * difference.extent_m();
    if (next.holds_zero && !is_apart) return -depth_of_cores(difference, next) - radii_m;
    // As near as rounding lets it come.
    if (next.holds_zero || !is_nearer(next, simplex)) break;
    simplex = next;
  }
  const double distance_m = simplex.nearest.norm() - radii_m;
  return distance_m > reach_m ? kInfinity : distance_m;
}

}  // namespace pilesim
