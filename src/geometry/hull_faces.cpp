#include "geometry/hull_faces.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <optional>
#include <queue>
#include <span>
#include <utility>

#include "geometry/half_edges.h"
#include "geometry/support_tree.h"

namespace pilesim {
namespace {

constexpr double kLeastFlatness = 5e-6;    // of the extent
constexpr double kMostOfThickness = 0.01;  // of the smallest principal extent
// The area vector of a face is as long as the sum of its triangles' areas; round an edge it is not.
constexpr double kLeastUnfolded = 0.9;
// The normal of a triangle whose height is a smaller share of its length is mostly rounding.
constexpr double kSliver = 1e-6;

// Triangles over the edges of each triangle, in the order of its corners.
std::vector<std::array<uint32_t, 3>> triangle_neighbours(const TriangleMesh& hull) {
  std::vector<std::array<uint32_t, 3>> neighbours(hull.triangles.size());
  const HalfEdges sides(hull.triangles, hull.vertices.size());
  sides.for_each_edge([&](std::span<const HalfEdge> edge) {
    for (const HalfEdge& side : edge) {
      const auto over = std::ranges::find(edge, !side.forward, &HalfEdge::forward);
      neighbours[side.triangle][side.corner] = over == edge.end() ? side.triangle : over->triangle;
    }
  });
  return neighbours;
}

// Twice the area times the outward normal.
Vec3 area_vector(const TriangleMesh& hull, uint32_t t) {
  const auto& [a, b, c] = hull.triangles[t];
  return (hull.vertices[b] - hull.vertices[a]).cross(hull.vertices[c] - hull.vertices[a]);
}

double longest_side(const TriangleMesh& hull, uint32_t t) {
  double longest = 0;
  for (size_t k = 0; k < 3; ++k) {
    const Triangle& corners = hull.triangles[t];
    longest =
        std::max(longest, (hull.vertices[corners[k]] - hull.vertices[corners[(k + 1) % 3]]).norm());
  }
  return longest;
}

struct Plane {
  Vec3 normal = Vec3::UnitZ();
  double middle_m = 0;  // normal . x half-way between the extreme points
  double spread_m = std::numeric_limits<double>::infinity();  // of the points, half of it
};

Plane plane_across(std::span<const Vec3> points, const Vec3& normal) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const Vec3& point : points) {
    low = std::min(low, normal.dot(point));
    high = std::max(high, normal.dot(point));
  }
  return {normal, (low + high) / 2, (high - low) / 2};
}

// A plane with all points within `tolerance`, if there is one: across `area`, the sum of the
// triangles' area vectors, or else by Lawson's reweighted least squares, which approach the plane
// with the least greatest distance.
std::optional<Plane> common_plane(std::span<const Vec3> points, const Vec3& area,
                                  double tolerance) {
  constexpr int kRounds = 16;
  const Plane across = plane_across(points, area.stableNormalized());
  if (across.spread_m <= tolerance) return across;
  std::vector<double> weight(points.size(), 1.0 / static_cast<double>(points.size()));
  for (int round = 0; round < kRounds; ++round) {
    Vec3 centre = Vec3::Zero();
    for (size_t i = 0; i < points.size(); ++i) centre += weight[i] * points[i];
    Mat3 moments = Mat3::Zero();
    for (size_t i = 0; i < points.size(); ++i) {
      moments += weight[i] * (points[i] - centre) * (points[i] - centre).transpose();
    }
    const Eigen::SelfAdjointEigenSolver<Mat3> axes(moments);
    // No plane has a smaller mean square, however the points are weighted.
    if (axes.eigenvalues()(0) > tolerance * tolerance) return std::nullopt;
    Vec3 normal = axes.eigenvectors().col(0);
    if (normal.dot(area) < 0) normal = -normal;
    const Plane plane = plane_across(points, normal);
    if (plane.spread_m <= tolerance) return plane;
    double sum = 0;
    for (size_t i = 0; i < points.size(); ++i) {
      weight[i] *= std::abs(normal.dot(points[i] - centre));
      sum += weight[i];
    }
    if (!(sum > 0)) return std::nullopt;
    for (double& w : weight) w /= sum;
  }
  return std::nullopt;
}

// Grows faces from the largest triangle that has none, the best fitting neighbour first.
class FaceGrower {
 public:
  explicit FaceGrower(const TriangleMesh& hull)
      : hull_(hull),
        neighbours_(triangle_neighbours(hull)),
        tolerance_(face_tolerance(hull)),
        taken_(hull.triangles.size(), 0),
        in_face_(hull.vertices.size(), 0) {}

  std::vector<HullFace> grow() {
    std::vector<double> area;
    for (uint32_t t = 0; t < hull_.triangles.size(); ++t) {
      area.push_back(area_vector(hull_, t).norm());
    }
    std::vector<uint32_t> order(area.size());
    std::iota(order.begin(), order.end(), 0U);
    std::ranges::stable_sort(order, std::greater{}, [&](uint32_t t) { return area[t]; });
    std::vector<HullFace> faces;
    for (const uint32_t t : order) {
      if (taken_[t] == 0) faces.push_back(grow_from(t));
    }
    return faces;
  }

 private:
  struct Candidate {
    double distance;
    uint32_t triangle;
    auto operator<=>(const Candidate&) const = default;
  };

  double distance(uint32_t t) const {
    double most = 0;
    for (const uint32_t v : hull_.triangles[t]) {
      most = std::max(most, std::abs(plane_.normal.dot(hull_.vertices[v]) - plane_.middle_m));
    }
    return most;
  }

  void add(uint32_t t) {
    taken_[t] = 1;
    area_ += area_vector(hull_, t);
    total_area_ += area_vector(hull_, t).norm();
    for (const uint32_t v : hull_.triangles[t]) {
      if (std::exchange(in_face_[v], 1) == 0) {
        vertices_.push_back(v);
        points_.push_back(hull_.vertices[v]);
      }
    }
  }

  bool fits(uint32_t t) {
    const Vec3 area = area_ + area_vector(hull_, t);
    if (area.norm() < kLeastUnfolded * (total_area_ + area_vector(hull_, t).norm())) return false;
    if (distance(t) <= tolerance_) return true;
    const size_t before = points_.size();
    for (const uint32_t v : hull_.triangles[t]) {
      if (in_face_[v] == 0) points_.push_back(hull_.vertices[v]);
    }
    const std::optional<Plane> plane = common_plane(points_, area, tolerance_);
    points_.resize(before);
    if (plane) plane_ = *plane;
    return plane.has_value();
  }

  HullFace grow_from(uint32_t seed) {
    vertices_.clear();
    points_.clear();
    area_.setZero();
    total_area_ = 0;
    add(seed);
    plane_ = plane_across(points_, area_.stableNormalized());
    std::priority_queue<Candidate, std::vector<Candidate>, std::greater<>> front;
    const auto look_round = [&](uint32_t t) {
      for (const uint32_t next : neighbours_[t]) {
        if (taken_[next] == 0) front.push({distance(next), next});
      }
    };
    look_round(seed);
    size_t triangles = 1;
    while (!front.empty()) {
      const uint32_t t = front.top().triangle;
      front.pop();
      if (taken_[t] != 0 || !fits(t)) continue;
      add(t);
      look_round(t);
      ++triangles;
    }
    const Plane across = plane_across(points_, area_.stableNormalized());
    if (across.spread_m <= tolerance_) plane_ = across;
    HullFace face{.normal = plane_.normal, .vertices = vertices_};
    const double length = longest_side(hull_, seed);
    const bool exact = triangles == 1 && total_area_ > kSliver * length * length;
    face.offset_m = -std::numeric_limits<double>::infinity();
    for (const Vec3& point : points_) {
      face.offset_m = std::max(face.offset_m, face.normal.dot(point));
    }
    if (!exact) {
      if (!all_vertices_) all_vertices_.emplace(hull_.vertices);
      face.offset_m = all_vertices_->support(face.normal, face.offset_m).offset_m;
    }
    for (const uint32_t v : vertices_) in_face_[v] = 0;
    return face;
  }

  const TriangleMesh& hull_;
  std::vector<std::array<uint32_t, 3>> neighbours_;
  double tolerance_;
  std::optional<SupportTree> all_vertices_;  // made when a face needs it
  std::vector<uint8_t> taken_;               // by triangle
  std::vector<uint8_t> in_face_;             // by vertex: of the face that grows
  std::vector<uint32_t> vertices_;
  std::vector<Vec3> points_;
  Vec3 area_ = Vec3::Zero();
  double total_area_ = 0;
  Plane plane_;
};

}  // namespace

double face_tolerance(const TriangleMesh& hull) {
  Vec3 centre = Vec3::Zero();
  for (const Vec3& v : hull.vertices) centre += v / static_cast<double>(hull.vertices.size());
  Mat3 moments = Mat3::Zero();
  for (const Vec3& v : hull.vertices) moments += (v - centre) * (v - centre).transpose();
  const Eigen::SelfAdjointEigenSolver<Mat3> axes(moments);
  const double thickness = 2 * plane_across(hull.vertices, axes.eigenvectors().col(0)).spread_m;
  const double extent = hull.bounds().diagonal().norm();
  return std::min(kMostOfThickness * thickness,
                  std::max(2 * hull.rounding_m, kLeastFlatness * extent));
}

std::vector<HullFace> flat_faces(const TriangleMesh& hull) { return FaceGrower(hull).grow(); }

}  // namespace pilesim
