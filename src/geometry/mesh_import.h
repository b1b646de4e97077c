// Meshes from files, through assimp (obj, stl, ply, glb and all else that assimp reads).
#pragma once

#include <filesystem>

#include "geometry/mesh.h"

namespace pilesim {

// All triangles of the file in one mesh, in the file's own frame times `scale` (> 0), node
// transformations applied, polygons triangulated, points and lines dropped. Vertices closer than
// 1e-6 of the bounding diagonal are welded and the triangles that collapse by it are removed. Each
// OBJ group or named node becomes a MeshGroup. Each triangle has the base colour of its material,
// the mean of its texture where that has one that can be read, see `lost_textures`; the texture
// itself is in `texture_map`, at most kLargestTexture pixels a side. `rounding_m` is told from the
// digits of the file's coordinates. Throws Error(io) if the file cannot be read, Error(input) if it
// is no mesh, is empty or has coordinates that are not finite.
TriangleMesh import_mesh(const std::filesystem::path& file, double scale = 1.0);

}  // namespace pilesim
