#include "geometry/hollow_depth.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "core/parallel_for.h"
#include "geometry/convex_hull.h"

namespace pilesim {
namespace {

constexpr size_t kMostRays = 2000;   // that are followed to the surface opposite
constexpr double kNearCorner = 0.9;  // of the way from a triangle's middle to its corners

struct Ray {
  Vec3 from, along;
  double covered_m;  // by the hull
};

bool holds(const FacetedSolid& solid, const FacetedSolid::Face& face, const Vec3& point) {
  int drop = 0;
  face.normal.cwiseAbs().maxCoeff(&drop);
  const int u = (drop + 1) % 3, v = (drop + 2) % 3;
  bool inside = false;
  for (uint32_t e = face.first_edge; e < face.first_edge + face.edge_count; ++e) {
    const Vec3& a = solid.vertices[solid.edges[e].from];
    const Vec3& b = solid.vertices[solid.edges[e].to];
    if ((a[v] > point[v]) == (b[v] > point[v])) continue;
    const double crossing = a[u] + (point[v] - a[v]) / (b[v] - a[v]) * (b[u] - a[u]);
    if (point[u] < crossing) inside = !inside;
  }
  return inside;
}

// To the nearest face by which the ray enters the solid, at most as far as the hull covers it.
double way_to_opposite(const FacetedSolid& solid, const Ray& ray) {
  double nearest = ray.covered_m;
  for (const FacetedSolid::Face& face : solid.faces) {
    const double against = -face.normal.dot(ray.along);
    if (face.is_cap || against <= 1e-9) continue;
    const Vec3& corner = solid.vertices[solid.edges[face.first_edge].from];
    const double above = face.normal.dot(ray.from - corner);
    if (above <= 0 || above >= nearest * against) continue;
    if (holds(solid, face, ray.from + above / against * ray.along)) nearest = above / against;
  }
  return nearest;
}

std::vector<Ray> covered_rays(const ConvexPart& part, double least_m) {
  struct Plane {
    Vec3 normal;
    double offset;
  };
  std::vector<Plane> roof;
  const TriangleMesh hull = convex_hull(part.hull_points);
  for (const auto& [a, b, c] : hull.triangles) {
    const Vec3& corner = hull.vertices[a];
    const Vec3 normal =
        (hull.vertices[b] - corner).cross(hull.vertices[c] - corner).stableNormalized();
    if (!normal.isZero()) roof.push_back({normal, normal.dot(corner)});
  }
  std::vector<Ray> rays;
  const auto add = [&](const Vec3& from, const Vec3& along) {
    double covered = std::numeric_limits<double>::infinity();
    for (const Plane& plane : roof) {
      const double rate = plane.normal.dot(along);
      if (rate <= 1e-12) continue;
      covered = std::min(covered, (plane.offset - plane.normal.dot(from)) / rate);
      if (covered <= least_m) return;
    }
    if (std::isfinite(covered)) rays.push_back({from, along, covered});
  };
  const FacetedSolid& solid = part.solid;
  for (const FacetedSolid::Face& face : solid.faces) {
    if (face.is_cap) continue;
    const Vec3& first = solid.vertices[solid.edges[face.first_edge].from];
    for (uint32_t e = face.first_edge; e < face.first_edge + face.edge_count; ++e) {
      const Vec3& a = solid.vertices[solid.edges[e].from];
      const Vec3& b = solid.vertices[solid.edges[e].to];
      // Triangles of a fan that turn back lie outside of the face.
      if ((a - first).cross(b - first).dot(face.normal) <= 0) continue;
      const Vec3 middle = (first + a + b) / 3;
      add(middle, face.normal);
      for (const Vec3& corner : {first, a, b}) {
        add(middle + kNearCorner * (corner - middle), face.normal);
      }
    }
  }
  return rays;
}

}  // namespace

double hollow_depth(const ConvexPart& part, double least_m) {
  const std::vector<Ray> rays = covered_rays(part, least_m);
  const size_t stride = (rays.size() + kMostRays - 1) / kMostRays;
  if (stride == 0) return 0;
  std::vector<double> depths((rays.size() + stride - 1) / stride);
  parallel_for(depths.size(), 16, [&](size_t begin, size_t end) {
    for (size_t k = begin; k < end; ++k) depths[k] = way_to_opposite(part.solid, rays[k * stride]);
  });
  const double deepest = std::ranges::max(depths);
  return deepest > least_m ? deepest : 0;
}

}  // namespace pilesim
