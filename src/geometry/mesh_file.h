// The contents of a mesh file, read by assimp in a process of its own: assimp believes the lengths
// that it reads, and a broken file of one of its forty formats may make it do anything.
#pragma once

#include <filesystem>
#include <string>

#include "core/error.h"
#include "geometry/mesh.h"

namespace pilesim {

// All triangles as they are in the file, times `scale` (> 0), with vertices neither shared nor
// welded, for import_mesh(). Colours are kept where the file has others than one grey, which
// programs give to things without a colour. Vertices are finite and indices in range. Memory and
// time for reading are bounded by the sizes of the file and of those that it names. Throws as
// import_mesh() does.
TriangleMesh read_mesh_file(const std::filesystem::path& file, double scale);

// Error(input) for a file that holds no mesh.
Error no_mesh(const std::filesystem::path& file, std::string found);

}  // namespace pilesim
