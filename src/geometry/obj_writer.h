// Wavefront OBJ, with groups. Numbers are the shortest that read back to the same float, so the
// same mesh gives the same bytes on every machine.
#pragma once

#include <filesystem>

#include "geometry/mesh.h"

namespace pilesim {

// Throws Error(io). Written beside its place and renamed.
void write_obj(const TriangleMesh& mesh, const std::filesystem::path& file);

}  // namespace pilesim
