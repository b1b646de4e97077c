// Shapes of a scene made ready for use: meshes loaded and checked, mass computed, collision pieces
// built.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "core/error.h"
#include "geometry/mesh.h"
#include "geometry/solid.h"
#include "model/model.h"
#include "scene/scene.h"

namespace pilesim {

// Each mesh file at one scale and one way up, loaded once.
class MeshLibrary {
 public:
  // Throws as import_mesh() does.
  const TriangleMesh& load(const std::filesystem::path& file, const Vec3& scale,
                           UpAxis up = UpAxis::y);
  const TriangleMesh& load(const std::filesystem::path& file, double scale) {
    return load(file, Vec3::Constant(scale));
  }
  // The solid that it encloses, as make_solid() makes it from the whole: its surface has nothing of
  // it on the other side, so parts that overlap are wrapped even where groups name each of them.
  // Throws as make_solid() does, too.
  const Solid& load_solid(const std::filesystem::path& file, double scale);

 private:
  std::map<std::tuple<std::filesystem::path, std::array<double, 3>, UpAxis>, TriangleMesh> meshes_;
  std::map<std::pair<std::filesystem::path, double>, Solid> solids_;
};

// Metres per unit of the mesh `file` that make its longest side `size_m` long.
double scale_to(double size_m, const std::filesystem::path& file, MeshLibrary& meshes);

// How the mesh of `shape` becomes a solid.
SolidOptions solid_options(const MeshShape& shape);

// The JSON pointer of the shape called `name`.
std::string shape_pointer(const std::string& name);

// All shapes of a scene together have no more, drawn and collided with: parts of compounds and
// sizes of emitters multiply the triangles of files.
inline constexpr size_t kMostTriangles = 20'000'000;
size_t triangles_of(const ModelShape& shape);
// The error at the shape's `pointer` that exceeds it.
Error too_many_triangles(const std::string& pointer);

// `shape` times `size` in all its measures, as an emitter with sizes has it.
ModelShape resized(const ModelShape& shape, double size);

// The shape called `name`. Throws Error naming its JSON pointer and, for meshes, the file.
ModelShape build_shape(const Scene& scene, const std::string& name, MeshLibrary& meshes);

}  // namespace pilesim
