#include "geometry/surface_distance.h"

#include <algorithm>
#include <cmath>

#include "core/parallel_for.h"
#include "geometry/mesh_clip.h"
#include "geometry/triangle_tree.h"

namespace pilesim {
namespace {

constexpr double kSamples = 40'000;  // on each surface

using Polygon = std::vector<Vec3>;  // convex, in order

struct ConvexPiece {
  std::vector<ClipPlane> planes;  // of its facets, normals outward
  Bounds bounds;                  // with the margin
};

Vec3 facet_normal(const TriangleMesh& mesh, const Triangle& t) {
  const Vec3& a = mesh.vertices[t[0]];
  return (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a).stableNormalized();
}

ConvexPiece convex_piece(const TriangleMesh& mesh, double margin) {
  ConvexPiece piece;
  for (const Triangle& t : mesh.triangles) {
    const Vec3 normal = facet_normal(mesh, t);
    if (!normal.isZero()) piece.planes.push_back({normal, normal.dot(mesh.vertices[t[0]])});
  }
  piece.bounds = mesh.bounds();
  piece.bounds.min().array() -= margin;
  piece.bounds.max().array() += margin;
  return piece;
}

struct SplitPolygon {
  Polygon below, above;
};

SplitPolygon split(const Polygon& polygon, const ClipPlane& plane) {
  SplitPolygon result;
  for (size_t k = 0; k < polygon.size(); ++k) {
    const Vec3& from = polygon[k];
    const Vec3& to = polygon[(k + 1) % polygon.size()];
    const double from_distance = plane.distance(from);
    const double to_distance = plane.distance(to);
    (from_distance < 0 ? result.below : result.above).push_back(from);
    if ((from_distance < 0) != (to_distance < 0)) {
      const Vec3 crossing = plane_crossing(from, from_distance, to, to_distance);
      result.below.push_back(crossing);
      result.above.push_back(crossing);
    }
  }
  return result;
}

// A part of the surface of a piece.
struct Facet {
  Polygon polygon;
  Vec3 normal;
};

bool thinner_than(const Polygon& polygon, double width) {
  Vec3 doubled_area = Vec3::Zero();
  double perimeter = 0;
  for (size_t k = 0; k < polygon.size(); ++k) {
    const Vec3& from = polygon[k];
    const Vec3& to = polygon[(k + 1) % polygon.size()];
    doubled_area += (from - polygon[0]).cross(to - polygon[0]);
    perimeter += (to - from).norm();
  }
  return doubled_area.norm() < width * perimeter;
}

bool touches(const Polygon& polygon, const ClipPlane& plane, double tolerance) {
  return std::ranges::any_of(
      polygon, [&](const Vec3& p) { return std::abs(plane.distance(p)) <= tolerance; });
}

// Appends the parts of `facet` that lie outside of `piece` by more than `margin`. Where the facet
// is flush with one of the piece's own, facing the same way, it stays if `keep_flush`: of two such
// facets one has to.
void subtract(const Facet& facet, const ConvexPiece& piece, double margin, bool keep_flush,
              std::vector<Facet>& outside) {
  const auto& [polygon, normal] = facet;
  Bounds bounds;
  for (const Vec3& corner : polygon) bounds.extend(corner);
  if (!bounds.intersects(piece.bounds)) {
    outside.push_back(facet);
    return;
  }
  std::vector<ClipPlane> planes;  // that cut the facet
  Polygon covered = polygon;
  for (ClipPlane plane : piece.planes) {
    plane.offset += keep_flush && plane.normal.dot(normal) > 1 - 1e-9 ? -margin : margin;
    SplitPolygon parts = split(covered, plane);
    if (!parts.above.empty()) planes.push_back(plane);
    covered = std::move(parts.below);
    // A strip along a seam is there only because of the margin.
    if (covered.empty() || thinner_than(covered, 4 * margin)) {
      outside.push_back(facet);
      return;
    }
  }
  // Only the planes that bound the covered part in the end cut pieces off.
  Polygon rest = polygon;
  for (const ClipPlane& plane : planes) {
    if (!touches(covered, plane, 1e-3 * margin)) continue;
    SplitPolygon parts = split(rest, plane);
    if (!parts.above.empty()) outside.push_back({std::move(parts.above), normal});
    rest = std::move(parts.below);
  }
}

void append(const Polygon& polygon, TriangleMesh& mesh) {
  const auto first = static_cast<uint32_t>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), polygon.begin(), polygon.end());
  for (uint32_t k = 2; k < polygon.size(); ++k) {
    mesh.triangles.push_back({first, first + k - 1, first + k});
  }
}

double area(const TriangleMesh& mesh, const Triangle& t) {
  const Vec3& a = mesh.vertices[t[0]];
  return 0.5 * (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a).norm();
}

struct DistanceSum {
  double greatest = 0;       // m
  double area = 0;           // m^2
  double distance_area = 0;  // m^3: the integral of the distance over the area
};

// Point k of a sequence that fills the triangle evenly.
Vec3 triangle_point(const Corners& corners, int k) {
  const double s = (k + 1) * 0.7548776662466927;
  const double t = (k + 1) * 0.5698402909980532;
  double u = s - std::floor(s);
  double v = t - std::floor(t);
  if (u + v > 1) {
    u = 1 - u;
    v = 1 - v;
  }
  return corners[0] + u * (corners[1] - corners[0]) + v * (corners[2] - corners[0]);
}

// The greatest distance of a vertex of a triangle, m. Neighbours share it: it is asked for once.
double greatest_at_vertices(const TriangleMesh& from, const TriangleTree& to) {
  std::vector<uint8_t> is_used(from.vertices.size(), 0);
  for (const Triangle& t : from.triangles) {
    for (const uint32_t vertex : t) is_used[vertex] = 1;
  }
  constexpr size_t kGrain = 256;
  std::vector<double> greatest((from.vertices.size() + kGrain - 1) / kGrain, 0);
  parallel_for(from.vertices.size(), kGrain, [&](size_t begin, size_t end) {
    for (size_t v = begin; v < end; ++v) {
      if (is_used[v] == 0) continue;
      double& most = greatest[begin / kGrain];
      most = std::max(most, to.distance(from.vertices[v]));
    }
  });
  return greatest.empty() ? 0 : std::ranges::max(greatest);
}

DistanceSum distance_from(const TriangleMesh& from, const TriangleTree& to) {
  double total_area = 0;
  for (const Triangle& t : from.triangles) total_area += area(from, t);
  const size_t grain = 64;
  std::vector<DistanceSum> sums((from.triangles.size() + grain - 1) / grain);
  parallel_for(from.triangles.size(), grain, [&](size_t begin, size_t end) {
    DistanceSum& sum = sums[begin / grain];
    for (size_t k = begin; k < end; ++k) {
      const Triangle& t = from.triangles[k];
      const Corners corners{from.vertices[t[0]], from.vertices[t[1]], from.vertices[t[2]]};
      const double triangle_area = area(from, t);
      const int samples = static_cast<int>(std::ceil(kSamples * triangle_area / total_area));
      double distances = 0;
      for (int s = 0; s < samples; ++s) {
        const double distance = to.distance(triangle_point(corners, s));
        sum.greatest = std::max(sum.greatest, distance);
        distances += distance;
      }
      if (samples > 0) sum.distance_area += triangle_area * distances / samples;
      sum.area += triangle_area;
    }
  });
  DistanceSum result{.greatest = greatest_at_vertices(from, to)};
  for (const DistanceSum& sum : sums) {
    result.greatest = std::max(result.greatest, sum.greatest);
    result.area += sum.area;
    result.distance_area += sum.distance_area;
  }
  return result;
}

}  // namespace

TriangleMesh outer_surface(std::span<const TriangleMesh> pieces) {
  Bounds bounds;
  for (const TriangleMesh& piece : pieces) bounds.extend(piece.bounds());
  const double margin = 1e-6 * bounds.diagonal().norm();
  std::vector<ConvexPiece> convex;
  for (const TriangleMesh& piece : pieces) convex.push_back(convex_piece(piece, margin));

  TriangleMesh surface;
  for (size_t i = 0; i < pieces.size(); ++i) {
    std::vector<Facet> facets, next;
    const std::vector<Vec3>& v = pieces[i].vertices;
    for (const Triangle& t : pieces[i].triangles) {
      facets.push_back({{v[t[0]], v[t[1]], v[t[2]]}, facet_normal(pieces[i], t)});
    }
    for (size_t j = 0; j < pieces.size(); ++j) {
      if (j == i || !convex[j].bounds.intersects(convex[i].bounds)) continue;
      next.clear();
      for (const Facet& facet : facets) subtract(facet, convex[j], margin, i < j, next);
      facets.swap(next);
    }
    for (const Facet& facet : facets) {
      // Margins leave strips along seams inside.
      if (!thinner_than(facet.polygon, 8 * margin)) append(facet.polygon, surface);
    }
  }
  return surface;
}

SurfaceDistance surface_distance(const TriangleMesh& a, const TriangleMesh& b) {
  const DistanceSum from_a = distance_from(a, TriangleTree(b));
  const DistanceSum from_b = distance_from(b, TriangleTree(a));
  return {
      .hausdorff_m = std::max(from_a.greatest, from_b.greatest),
      .mean_m = 0.5 * (from_a.distance_area / from_a.area + from_b.distance_area / from_b.area)};
}

}  // namespace pilesim
