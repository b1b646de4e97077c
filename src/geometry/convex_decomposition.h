// Approximate convex decomposition: a solid as a union of convex pieces, with its error.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "geometry/mesh.h"

namespace pilesim {

struct DecompositionOptions {
  int max_pieces = 32;             // 1 .. 256
  double max_volume_error = 0.05;  // stop early once volume_error() is below this, > 0
  int max_piece_vertices = 64;     // 8 .. 255, of each piece's hull
};

struct Decomposition {
  std::vector<TriangleMesh> pieces;  // closed convex, the frame of the mesh
  double mesh_volume_m3 = 0;
  double union_volume_m3 = 0;    // of the union of the pieces (overlaps counted once)
  double excess_volume_m3 = 0;   // of pieces outside of the mesh
  double missing_volume_m3 = 0;  // of the mesh outside of all pieces
  double surface_error_m = 0;    // Hausdorff distance from the pieces' outer surface to the mesh's
  double mean_surface_error_m = 0;
  bool from_groups = false;  // the mesh named its own convex parts
  bool from_cache = false;

  // (excess + missing) / mesh volume: the accuracy figure that is reported.
  double volume_error() const { return (excess_volume_m3 + missing_volume_m3) / mesh_volume_m3; }
};

// `mesh` is a proper solid (find_mesh_defects is empty), or one whose groups are each a closed
// convex piece: those are taken as they are. Deterministic. The result is kept under
// `cache_directory`, named by mesh hash and options, and read from there the next time; no value:
// no cache.
Decomposition decompose(const TriangleMesh& mesh, const DecompositionOptions& options,
                        const std::optional<std::filesystem::path>& cache_directory);

}  // namespace pilesim
