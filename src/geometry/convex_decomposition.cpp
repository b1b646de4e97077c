#include "geometry/convex_decomposition.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "core/error.h"
#include "geometry/convex_hull.h"
#include "geometry/convex_partition.h"
#include "geometry/hull_volume.h"
#include "geometry/mass_properties.h"
#include "geometry/mesh_check.h"
#include "geometry/solid_difference.h"
#include "geometry/surface_distance.h"

namespace pilesim {
namespace {

// A group may be short of its hull by this part of its volume and still be taken as convex.
constexpr double kConvexTolerance = 1e-3;

void require_solid(const TriangleMesh& mesh) {
  std::vector<Problem> problems;
  for (const MeshDefect& defect : find_mesh_defects(mesh)) {
    problems.push_back(
        {.found = defect.text,
         .expected = "a closed mesh, or groups that are each closed and convex, to decompose",
         .remedy = "Mend the mesh or use its convex hull"});
  }
  if (!problems.empty()) throw Error(ErrorKind::input, std::move(problems));
}

TriangleMesh group_mesh(const TriangleMesh& mesh, const MeshGroup& group) {
  constexpr uint32_t kNone = ~0u;
  std::vector<uint32_t> index(mesh.vertices.size(), kNone);
  TriangleMesh part;
  for (uint32_t t = group.first_triangle; t < group.first_triangle + group.triangle_count; ++t) {
    Triangle triangle = mesh.triangles[t];
    for (uint32_t& vertex : triangle) {
      if (index[vertex] == kNone) {
        index[vertex] = static_cast<uint32_t>(part.vertices.size());
        part.vertices.push_back(mesh.vertices[vertex]);
      }
      vertex = index[vertex];
    }
    part.triangles.push_back(triangle);
  }
  return part;
}

bool is_convex(const TriangleMesh& mesh) {
  const double volume = mass_properties(mesh).volume_m3;
  return HullVolume().compute(mesh.vertices) - volume <= kConvexTolerance * volume;
}

// The groups as pieces, if there are two at least and each is closed and convex.
std::vector<TriangleMesh> convex_groups(const TriangleMesh& mesh) {
  if (mesh.groups.size() < 2) return {};
  std::vector<TriangleMesh> pieces;
  for (const MeshGroup& group : mesh.groups) {
    pieces.push_back(group_mesh(mesh, group));
    if (!find_mesh_defects(pieces.back()).empty() || !is_convex(pieces.back())) return {};
  }
  return pieces;
}

// Takes a mesh to bounds near 1 about the origin and back. The factor is a power of two, so that
// nothing is rounded by it.
struct Normalisation {
  Vec3 centre;
  double scale;

  explicit Normalisation(const TriangleMesh& mesh) {
    const Bounds bounds = mesh.bounds();
    centre = bounds.center();
    scale = std::exp2(std::ilogb(bounds.diagonal().norm()));
  }
  TriangleMesh apply(TriangleMesh mesh) const {
    for (Vec3& vertex : mesh.vertices) vertex = (vertex - centre) / scale;
    return mesh;
  }
  TriangleMesh undo(TriangleMesh mesh) const {
    for (Vec3& vertex : mesh.vertices) vertex = vertex * scale + centre;
    return mesh;
  }
};

std::vector<TriangleMesh> approximate_pieces(const TriangleMesh& mesh,
                                             const DecompositionOptions& options) {
  const Normalisation normalisation(mesh);
  const FacetedSolid solid = faceted_solid(normalisation.apply(mesh));
  const double volume = solid.volume();
  const std::vector<ConvexPart> parts = partition_into_convex(
      solid, {.max_parts = options.max_pieces,
              .max_excess_m3 = options.max_volume_error * volume});
  std::vector<TriangleMesh> pieces;
  for (const ConvexPart& part : parts) {
    if (part.hull_volume_m3 < 1e-9 * volume) continue;  // too thin to be a body
    pieces.push_back(
        normalisation.undo(simplified_hull(part.hull_points, options.max_piece_vertices)));
  }
  return pieces;
}

void measure(const TriangleMesh& mesh, Decomposition& result) {
  const SolidDifference difference = solid_difference(mesh, result.pieces);
  result.mesh_volume_m3 = mass_properties(mesh).volume_m3;
  result.union_volume_m3 = difference.union_volume_m3;
  result.excess_volume_m3 = difference.excess_m3();
  // Parts of a mesh that overlap count twice in its volume.
  result.missing_volume_m3 =
      difference.missing_m3() +
      (result.from_groups ? result.mesh_volume_m3 - difference.mesh_volume_m3 : 0.0);
  const SurfaceDistance distance = surface_distance(outer_surface(result.pieces), mesh);
  result.surface_error_m = distance.hausdorff_m;
  result.mean_surface_error_m = distance.mean_m;
}

}  // namespace

Decomposition decompose(const TriangleMesh& mesh, const DecompositionOptions& options,
                        const std::optional<std::filesystem::path>& cache_directory) {
  assert(options.max_pieces >= 1 && options.max_pieces <= 256);
  assert(options.max_volume_error > 0);
  assert(options.max_piece_vertices >= 8 && options.max_piece_vertices <= 255);

  Decomposition result;
  result.pieces = convex_groups(mesh);
  result.from_groups = !result.pieces.empty();
  if (!result.from_groups) {
    require_solid(mesh);
    result.pieces = approximate_pieces(mesh, options);
  }
  measure(mesh, result);
  return result;
}

}  // namespace pilesim
