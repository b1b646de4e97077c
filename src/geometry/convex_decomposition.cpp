#include "geometry/convex_decomposition.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "core/error.h"
#include "core/parallel_for.h"
#include "geometry/convex_partition.h"
#include "geometry/decomposition_cache.h"
#include "geometry/hull_volume.h"
#include "geometry/mass_properties.h"
#include "geometry/mesh_check.h"
#include "geometry/mesh_group.h"
#include "geometry/piece_fit.h"
#include "geometry/solid_difference.h"
#include "geometry/surface_distance.h"

namespace pilesim {
namespace {

// A group may be short of its hull by this part of its volume, for rounding, and still be convex.
constexpr double kConvexTolerance = 1e-5;
constexpr double kThinnest = 1e-9;     // of the mesh's volume: smaller parts are left out
constexpr double kMaxTrim = 0.02;      // of the bounding diagonal
constexpr double kMinTrimGain = 1e-5;  // of the mesh's volume

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

bool is_convex_solid(const TriangleMesh& mesh) {
  if (!find_mesh_defects(mesh).empty()) return false;
  const double volume = mass_properties(mesh).volume_m3;
  return HullVolume().compute(mesh.vertices) - volume <= kConvexTolerance * volume;
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

struct ApproximatePieces {
  std::vector<TriangleMesh> pieces;
  std::vector<double> excess_with_more;  // of ConvexPartition, in another unit
  double hollow_share = 0;               // of the longest side
};

// Pieces whose hulls are to come, before they are fitted, to this share of the error asked for.
ApproximatePieces approximate_pieces(const TriangleMesh& mesh, const DecompositionOptions& options,
                                     double share) {
  const Normalisation normalisation(mesh);
  const TriangleMesh normalised = normalisation.apply(mesh);
  const FacetedSolid solid = faceted_solid(normalised);
  const double volume = solid.volume();
  ConvexPartition partition = partition_into_convex(
      solid, {.max_parts = options.max_pieces,
              .max_excess_m3 = share * options.max_volume_error * volume,
              .max_depth_m = options.max_volume_error * normalised.bounds().sizes().maxCoeff()});
  std::vector<ConvexPart>& parts = partition.parts;
  std::erase_if(parts, [&](const ConvexPart& part) {
    return part.hull_volume_m3 < kThinnest * volume;  // no body to speak of
  });
  std::vector<TriangleMesh> pieces(parts.size());
  const PieceFitOptions fit{.max_vertices = options.max_piece_vertices,
                            .max_trim_m = kMaxTrim * normalised.bounds().diagonal().norm(),
                            .min_gain_m3 = kMinTrimGain * volume};
  parallel_for(parts.size(), 1, [&](size_t begin, size_t end) {
    for (size_t k = begin; k < end; ++k) {
      pieces[k] = normalisation.undo(fit_piece(parts[k], fit));
    }
  });
  return {std::move(pieces), std::move(partition.excess_with_more),
          partition.hollow_m / normalised.bounds().sizes().maxCoeff()};
}

void measure_volumes(const TriangleMesh& mesh, Decomposition& result) {
  const SolidDifference difference = solid_difference(mesh, result.pieces);
  result.mesh_volume_m3 = mass_properties(mesh).volume_m3;
  result.union_volume_m3 = difference.union_volume_m3;
  result.excess_volume_m3 = difference.excess_m3();
  result.missing_volume_m3 = difference.missing_m3();
  if (result.from_groups) {
    // Groups that overlap count twice in the volume of the mesh.
    result.missing_volume_m3 += result.mesh_volume_m3 - difference.mesh_volume_m3;
  }
}

void measure_surface(const TriangleMesh& mesh, Decomposition& result) {
  const SurfaceDistance distance = surface_distance(outer_surface(result.pieces), mesh);
  result.surface_error_m = distance.hausdorff_m;
  result.mean_surface_error_m = distance.mean_m;
  result.surface_share = distance.hausdorff_m / mesh.bounds().sizes().maxCoeff();
}

// The error goes with the excess of the hulls that the pieces are fitted to: so many more pieces as
// are enough, or as help most.
void offer_more(const DecompositionOptions& options, const std::vector<double>& excess_with_more,
                Decomposition& result) {
  constexpr int kMostPieces = 256;
  constexpr double kWorthSaying = 0.9;  // of the error
  const double error = result.volume_error();
  if (error <= options.max_volume_error || excess_with_more.front() <= 0) return;
  double least = kWorthSaying * error;
  for (size_t more = 1; more < excess_with_more.size(); ++more) {
    const int pieces = options.max_pieces + static_cast<int>(more);
    const double expected = error * excess_with_more[more] / excess_with_more.front();
    if (pieces > kMostPieces || least <= options.max_volume_error) break;
    if (expected >= least) continue;
    least = result.error_with_more = expected;
    result.more_pieces = pieces;
  }
}

// Fitting adds an error that only measuring shows. So the search is asked for less until the pieces
// are good enough or as many as allowed.
Decomposition approximate(const TriangleMesh& mesh, const DecompositionOptions& options) {
  Decomposition best;
  for (const double share : {0.8, 0.6, 0.4, 0.2}) {
    Decomposition result;
    auto [pieces, excess_with_more, hollow_share] = approximate_pieces(mesh, options, share);
    result.pieces = std::move(pieces);
    result.hollow_share = hollow_share;
    measure_volumes(mesh, result);
    const bool full = static_cast<int>(result.pieces.size()) >= options.max_pieces;
    if (full) offer_more(options, excess_with_more, result);
    if (best.pieces.empty() || result.volume_error() < best.volume_error()) best = result;
    if (full || best.volume_error() <= options.max_volume_error) break;
  }
  return best;
}

}  // namespace

std::vector<TriangleMesh> convex_groups(const TriangleMesh& mesh) {
  if (mesh.groups.size() < 2) return {};
  std::vector<TriangleMesh> pieces;
  for (const MeshGroup& group : mesh.groups) {
    pieces.push_back(group_mesh(mesh, group));
    if (!is_convex_solid(pieces.back())) return {};
  }
  return pieces;
}

Decomposition decompose(const TriangleMesh& mesh, const DecompositionOptions& options,
                        const std::optional<std::filesystem::path>& cache_directory) {
  assert(options.max_pieces >= 1 && options.max_pieces <= 256);
  assert(options.max_volume_error > 0);
  assert(options.max_piece_vertices >= 8 && options.max_piece_vertices <= 255);

  std::optional<DecompositionCache> cache;
  if (cache_directory) {
    cache.emplace(*cache_directory, mesh, options);
    if (std::optional<Decomposition> stored = cache->load()) return *stored;
  }
  Decomposition result;
  result.pieces = convex_groups(mesh);
  result.from_groups = !result.pieces.empty();
  if (result.from_groups) {
    measure_volumes(mesh, result);
  } else {
    require_solid(mesh);
    result = approximate(mesh, options);
    measure_surface(mesh, result);
  }
  if (cache) cache->store(result);
  return result;
}

}  // namespace pilesim
