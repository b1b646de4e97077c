// Approximate convex decomposition: a solid as a union of convex pieces, with its error.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "geometry/mesh.h"

namespace pilesim {

struct DecompositionOptions {
  int max_pieces = 32;  // 1 .. 256
  // Stop early once volume_error() is below this, and no hollow is filled that is deeper and wider
  // than this share of the mesh's longest side, > 0.
  double max_volume_error = 0.05;
  int max_piece_vertices = 64;  // 8 .. 255, of each piece's hull
};

struct Decomposition {
  std::vector<TriangleMesh> pieces;  // closed convex, the frame of the mesh
  double mesh_volume_m3 = 0;
  // Measured along lines through both solids, see solid_difference.h: to better than 0.05 % of the
  // mesh's volume. For pieces from groups the mesh's volume is the sum, so that overlaps are
  // missing.
  double union_volume_m3 = 0;    // of the union of the pieces (overlaps counted once)
  double excess_volume_m3 = 0;   // of pieces outside of the mesh
  double missing_volume_m3 = 0;  // of the mesh outside of all pieces
  // Between the pieces' outer surface and the mesh's, both ways, see surface_distance.h. 0 for
  // pieces from groups.
  double surface_error_m = 0;  // symmetric Hausdorff distance
  double surface_share = 0;    // the same as a share of the longest side of the mesh's bounds
  double mean_surface_error_m = 0;
  // The deepest hollow beyond the depth asked for that is filled because no more pieces are
  // allowed, as a share of the longest side; 0: there is none.
  double hollow_share = 0;
  bool from_groups = false;  // the mesh named its own convex parts
  // Where volume_error() is above the error asked for with as many pieces as allowed: so many would
  // come to about so much. 0: nothing to offer.
  int more_pieces = 0;
  double error_with_more = 0;
  bool from_cache = false;

  // (excess + missing) / mesh volume: the accuracy figure that is reported.
  double volume_error() const { return (excess_volume_m3 + missing_volume_m3) / mesh_volume_m3; }
};

// The mesh's groups as pieces, where there are two at least and each is closed and convex;
// otherwise none. Such pieces make a solid even where they touch or overlap.
std::vector<TriangleMesh> convex_groups(const TriangleMesh& mesh);

// `mesh` is a proper solid (find_mesh_defects is empty), or one with convex_groups: those are taken
// as they are, whatever the options. Otherwise the mesh is cut by planes where that saves most of
// the volume that convex hulls of the parts have too much, and each piece is fitted between its
// part and the hull. Where max_pieces do not suffice for max_volume_error the best found is
// returned: look at volume_error() and more_pieces. The same bytes whatever the number of threads.
// The result is kept in a file under `cache_directory`, named by a hash of the mesh, its groups and
// the options, and read from there the next time; a damaged file is replaced. No value: no cache.
// Throws Error(input) without a file for a mesh that is no solid, Error(io) if the cache cannot be
// written.
Decomposition decompose(const TriangleMesh& mesh, const DecompositionOptions& options,
                        const std::optional<std::filesystem::path>& cache_directory);

}  // namespace pilesim
