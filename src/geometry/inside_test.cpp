#include "geometry/inside_test.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "geometry/triangle_tree.h"

namespace pilesim {
namespace {

// A cluster is taken as a whole from this many of its radii on. With the second-order term below
// it keeps the whole sum within 1e-3.
constexpr double kFarRadii = 2.5;

// What a cluster of triangles looks like from afar: the first two terms of the Taylor expansion of
// its winding number about `centre`.
struct FarField {
  Vec3 centre = Vec3::Zero();  // mean of the triangles by area, m
  double radius = 0;           // m, of the ball about `centre` that holds them
  Vec3 dipole = Vec3::Zero();  // sum of area times normal, m^2
  Mat3 moment = Mat3::Zero();  // sum of (centroid - centre) times (area times normal)^T, m^3
};

Vec3 area_vector(const Corners& corners) {
  const auto& [a, b, c] = corners;
  return 0.5 * (b - a).cross(c - a);
}

FarField far_field(std::span<const Corners> cluster) {
  FarField field;
  double area_sum = 0;
  for (const Corners& corners : cluster) {
    const double area = area_vector(corners).norm();
    field.centre += area / 3.0 * (corners[0] + corners[1] + corners[2]);
    area_sum += area;
  }
  field.centre = area_sum > 0 ? Vec3(field.centre / area_sum) : cluster[0][0];
  for (const Corners& corners : cluster) {
    const Vec3 area = area_vector(corners);
    const Vec3 centroid = (corners[0] + corners[1] + corners[2]) / 3.0;
    field.dipole += area;
    field.moment += (centroid - field.centre) * area.transpose();
    for (const Vec3& corner : corners) {
      field.radius = std::max(field.radius, (corner - field.centre).norm());
    }
  }
  return field;
}

// Solid angle of the cluster as seen from `-offset` relative to its centre, sr.
double far_solid_angle(const FarField& field, const Vec3& offset, double distance_squared) {
  const double inverse = 1.0 / std::sqrt(distance_squared);
  const double cubed = inverse * inverse * inverse;
  const double dipole = field.dipole.dot(offset);
  const double moment =
      field.moment.trace() - 3.0 * offset.dot(field.moment * offset) * inverse * inverse;
  return (dipole + moment) * cubed;
}

// Signed solid angle of a triangle (Van Oosterom and Strackee 1983), sr.
double solid_angle(const Corners& corners, const Vec3& point) {
  const Vec3 a = corners[0] - point, b = corners[1] - point, c = corners[2] - point;
  const double la = a.norm(), lb = b.norm(), lc = c.norm();
  const double volume = a.dot(b.cross(c));
  const double scale = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
  return 2.0 * std::atan2(volume, scale);
}

}  // namespace

struct InsideTest::Tree {
  explicit Tree(const TriangleMesh& mesh) : triangles(mesh, 8) {
    const std::span<const Corners> corners(triangles.corners());
    fields.reserve(triangles.nodes().size());
    for (const TriangleTree::Node& node : triangles.nodes()) {
      fields.push_back(far_field(corners.subspan(node.first, node.count)));
    }
  }

  double solid_angle_below(uint32_t index, const Vec3& point) const {
    const FarField& field = fields[index];
    const Vec3 offset = field.centre - point;
    const double distance_squared = offset.squaredNorm();
    if (distance_squared > kFarRadii * kFarRadii * field.radius * field.radius) {
      return far_solid_angle(field, offset, distance_squared);
    }
    const TriangleTree::Node& node = triangles.nodes()[index];
    if (!node.is_leaf()) {
      return solid_angle_below(index + 1, point) + solid_angle_below(node.right, point);
    }
    double sum = 0;
    for (uint32_t i = node.first; i < node.first + node.count; ++i) {
      sum += solid_angle(triangles.corners()[i], point);
    }
    return sum;
  }

  TriangleTree triangles;
  std::vector<FarField> fields;  // per node
};

InsideTest::InsideTest(const TriangleMesh& mesh) : tree_(std::make_unique<Tree>(mesh)) {}
InsideTest::~InsideTest() = default;
InsideTest::InsideTest(InsideTest&&) noexcept = default;
InsideTest& InsideTest::operator=(InsideTest&&) noexcept = default;

double InsideTest::winding_number(const Vec3& point) const {
  return tree_->solid_angle_below(0, point) / (4.0 * kPi);
}

}  // namespace pilesim
