// Shapes of a scene made ready for use: meshes loaded and checked, mass computed, collision pieces
// built.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/error.h"
#include "geometry/mesh.h"
#include "geometry/mesh_check.h"
#include "model/model.h"
#include "scene/scene.h"

namespace pilesim {

// Each mesh file at one scale, loaded once.
class MeshLibrary {
 public:
  // Throws as import_mesh() does.
  const TriangleMesh& load(const std::filesystem::path& file, double scale);

 private:
  std::map<std::pair<std::filesystem::path, double>, TriangleMesh> meshes_;
};

// Where decompositions are kept: $XDG_CACHE_HOME/pilesim, else ~/.cache/pilesim; none if neither is
// known or writable.
std::optional<std::filesystem::path> cache_directory();

// The defects as problems of `file`, named at `pointer`.
std::vector<Problem> defect_problems(const std::vector<MeshDefect>& defects,
                                     const std::filesystem::path& file, const std::string& pointer);

// The JSON pointer of the shape called `name`.
std::string shape_pointer(const std::string& name);

// The shape called `name`. Throws Error naming its JSON pointer and, for meshes, the file.
ModelShape build_shape(const Scene& scene, const std::string& name, MeshLibrary& meshes);

}  // namespace pilesim
