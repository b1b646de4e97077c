#include "geometry/piece_fit.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "geometry/convex_hull.h"
#include "geometry/hull_volume.h"

namespace pilesim {
namespace {

constexpr size_t kGroundNormals = 24;
// Smaller differences are rounding: the earlier point stays.
constexpr double kTie = 1e-9;

struct Trim {
  Vec3 normal;
  double offset = 0;
  double gain = 0;  // m^3 of error saved when last looked at
};

// A hull that is being cut, and the rest of the part inside of it.
struct Trimmed {
  FacetedSolid hull, part;

  // Gain of a cut at the plane, m^3: air saved less solid lost.
  double gain(const ClipPlane& plane) const {
    return hull.volume_above(plane) - 2 * part.volume_above(plane);
  }
};

// The best depth along the trim's normal.
Trim best_depth(const Trimmed& trimmed, const Vec3& normal, double max_depth) {
  double top = -std::numeric_limits<double>::infinity();
  for (const Vec3& vertex : trimmed.hull.vertices) top = std::max(top, normal.dot(vertex));
  Trim best{.normal = normal, .offset = top, .gain = 0};
  const auto look_at = [&](double depth) {
    const double gain = trimmed.gain({normal, top - depth});
    if (gain > best.gain) best = {normal, top - depth, gain};
  };
  for (const double share : {0.03, 0.06, 0.12, 0.25, 0.5, 1.0}) look_at(share * max_depth);
  const double coarse = top - best.offset;
  if (coarse > 0) {
    for (const double factor : {0.65, 0.8, 1.25, 1.55}) {
      look_at(std::min(factor * coarse, max_depth));
    }
  }
  return best;
}

bool is_new(const std::vector<Vec3>& normals, const Vec3& normal, double least_distance) {
  return !normal.isZero() && std::ranges::none_of(normals, [&](const Vec3& other) {
    return normal.dot(other) > 1 - least_distance;
  });
}

// Normals of the largest faces, in falling order of area.
std::vector<Vec3> large_faces(const FacetedSolid& solid) {
  std::vector<std::pair<double, Vec3>> by_area;
  for (const FacetedSolid::Face& face : solid.faces) {
    double area = 0;
    const Vec3& corner = solid.vertices[solid.edges[face.first_edge].from];
    for (uint32_t e = face.first_edge; e < face.first_edge + face.edge_count; ++e) {
      area += (solid.vertices[solid.edges[e].from] - corner)
                  .cross(solid.vertices[solid.edges[e].to] - corner)
                  .dot(face.normal);
    }
    by_area.emplace_back(area, face.normal);
  }
  std::ranges::stable_sort(by_area, std::ranges::greater{}, &std::pair<double, Vec3>::first);
  std::vector<Vec3> normals;
  for (const auto& [area, normal] : by_area) {
    if (normals.size() == kGroundNormals) break;
    if (is_new(normals, normal, 1e-3)) normals.push_back(normal);
  }
  return normals;
}

// Facets of the hull roof over hollows; large faces of the part say how the ground runs below.
std::vector<Vec3> trim_normals(const Trimmed& trimmed) {
  std::vector<Vec3> normals;
  for (const FacetedSolid::Face& face : trimmed.hull.faces) {
    if (is_new(normals, face.normal, 1e-4)) normals.push_back(face.normal);
  }
  for (const Vec3& normal : large_faces(trimmed.part)) {
    if (is_new(normals, normal, 1e-4)) normals.push_back(normal);
  }
  return normals;
}

void trim(Trimmed& trimmed, const PieceFitOptions& options) {
  std::vector<Trim> trims;
  for (const Vec3& normal : trim_normals(trimmed)) {
    trims.push_back(best_depth(trimmed, normal, options.max_trim_m));
  }
  // Gains shrink with every cut, so the best is looked at again before it is made.
  while (!trims.empty()) {
    const auto best = std::ranges::max_element(trims, {}, &Trim::gain);
    const double promised = best->gain;
    if (promised <= options.min_gain_m3) return;
    *best = best_depth(trimmed, best->normal, options.max_trim_m);
    if (best->gain < 0.9 * promised) continue;
    const ClipPlane plane{best->normal, best->offset};
    best->gain = 0;
    FacetedSolid hull = split(trimmed.hull, plane).below, part = split(trimmed.part, plane).below;
    // The hull of a thin shell is nearly all air; cuts that would leave nothing are skipped.
    if (hull.vertices.empty() || part.vertices.empty()) continue;
    trimmed.hull = std::move(hull);
    trimmed.part = std::move(part);
  }
}

bool lexicographically_less(const Vec3& a, const Vec3& b) {
  return std::ranges::lexicographical_compare(a, b);
}

// Vertices of the hull where two cuts meet.
std::vector<Vec3> seam_ends(const ConvexPart& part, const FacetedSolid& hull) {
  const FacetedSolid& solid = part.solid;
  std::vector<const Vec3*> cap_normal(solid.vertices.size(), nullptr);
  std::vector<Vec3> ends;
  for (const FacetedSolid::Face& face : solid.faces) {
    if (!face.is_cap) continue;
    for (uint32_t e = face.first_edge; e < face.first_edge + face.edge_count; ++e) {
      const uint32_t v = solid.edges[e].from;
      if (cap_normal[v] == nullptr) cap_normal[v] = &face.normal;
      if (std::abs(cap_normal[v]->dot(face.normal)) < 0.999) ends.push_back(solid.vertices[v]);
    }
  }
  std::vector<Vec3> corners = hull.vertices;
  std::ranges::sort(corners, lexicographically_less);
  std::ranges::sort(ends, lexicographically_less);
  std::vector<Vec3> kept;
  std::ranges::set_intersection(corners, ends, std::back_inserter(kept), lexicographically_less);
  kept.erase(std::unique(kept.begin(), kept.end()), kept.end());
  return kept;
}

}  // namespace

// `points` of a convex polytope so that their hull keeps most of its volume: after `kept` each time
// the one that adds most.
TriangleMesh most_of_the_hull(const std::vector<Vec3>& points, std::vector<Vec3> kept, int count) {
  HullVolume hull;
  // The first four by distance, so that there is a volume to add to.
  while (kept.size() < 4 || hull.compute(kept) == 0) {
    const auto farthest = std::ranges::max_element(points, {}, [&](const Vec3& point) {
      double distance = std::numeric_limits<double>::infinity();
      for (const Vec3& other : kept) distance = std::min(distance, (point - other).norm());
      return distance;
    });
    kept.push_back(*farthest);
    if (kept.size() > static_cast<size_t>(count)) break;
  }
  while (kept.size() < static_cast<size_t>(count)) {
    double most = hull.compute(kept);
    const Vec3* best = nullptr;
    kept.emplace_back();
    for (const Vec3& point : points) {
      kept.back() = point;
      const double volume = hull.compute(kept);
      if (volume > most * (1 + kTie)) {
        most = volume;
        best = &point;
      }
    }
    kept.pop_back();
    if (best == nullptr) break;
    kept.push_back(*best);
  }
  return convex_hull(kept);
}

TriangleMesh fit_piece(const ConvexPart& part, const PieceFitOptions& options) {
  Trimmed trimmed{faceted_solid(convex_hull(part.hull_points)), part.solid};
  trim(trimmed, options);
  TriangleMesh full = convex_hull(trimmed.hull.vertices);
  if (full.vertices.size() <= static_cast<size_t>(options.max_vertices)) return full;
  std::vector<Vec3> kept = seam_ends(part, trimmed.hull);
  if (kept.size() > static_cast<size_t>(options.max_vertices) / 2) kept.clear();
  return most_of_the_hull(full.vertices, std::move(kept), options.max_vertices);
}

}  // namespace pilesim
