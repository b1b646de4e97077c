#include "generate/convex_parts.h"

#include <cassert>

#include "generate/swept_surface.h"

namespace pilesim {

void append_group(TriangleMesh& mesh, const std::string& name, const TriangleMesh& part) {
  const auto first_vertex = static_cast<uint32_t>(mesh.vertices.size());
  mesh.groups.push_back({name, static_cast<uint32_t>(mesh.triangles.size()),
                         static_cast<uint32_t>(part.triangles.size())});
  mesh.vertices.insert(mesh.vertices.end(), part.vertices.begin(), part.vertices.end());
  for (const Triangle& triangle : part.triangles) {
    mesh.triangles.push_back(
        {triangle[0] + first_vertex, triangle[1] + first_vertex, triangle[2] + first_vertex});
  }
}

TriangleMesh box_between(const Vec3& lower, const Vec3& upper) {
  const auto face = [&](double y) {
    return std::vector<Vec3>{{lower.x(), y, upper.z()},
                             {upper.x(), y, upper.z()},
                             {upper.x(), y, lower.z()},
                             {lower.x(), y, lower.z()}};
  };
  return prism(face(lower.y()), face(upper.y()));
}

TriangleMesh prism(std::span<const Vec3> bottom, std::span<const Vec3> top) {
  assert(bottom.size() == top.size());
  return loft({{bottom.begin(), bottom.end()}, {top.begin(), top.end()}});
}

std::vector<Vec3> regular_polygon(const Vec3& centre, int axis, double radius, int count,
                                  double phase) {
  std::vector<Vec3> corners;
  for (int i = 0; i < count; ++i) {
    const double angle = 2 * kPi * (i + phase) / count;
    Vec3 corner = centre;
    corner[(axis + 1) % 3] += radius * std::cos(angle);
    corner[(axis + 2) % 3] += radius * std::sin(angle);
    corners.push_back(corner);
  }
  return corners;
}

TriangleMesh cylinder_between(const Vec3& start, int axis, double length, double radius, int sides,
                              double bevel) {
  const Vec3 direction = Vec3::Unit(axis);
  std::vector<std::vector<Vec3>> rings;
  const auto add_ring = [&](double along, double ring_radius) {
    rings.push_back(regular_polygon(start + along * direction, axis, ring_radius, sides));
  };
  if (bevel > 0) add_ring(0, radius - bevel);
  add_ring(bevel, radius);
  add_ring(length - bevel, radius);
  if (bevel > 0) add_ring(length, radius - bevel);
  return loft(rings);
}

}  // namespace pilesim
