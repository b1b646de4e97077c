// The base colours that a mesh file gives its triangles: of materials, textures and vertices, as
// assimp has read them. Runs where mesh files are read (geometry/mesh_file.h).
#pragma once

#include <assimp/scene.h>

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/colour.h"
#include "core/types.h"

namespace pilesim {

class BaseColours {
 public:
  // The bytes of a file by the name that the mesh file gives it; null where there is none.
  using FindFile = std::function<const std::string*(const std::string& name)>;

  // `colours_are_linear`: those of materials and vertices; else they are sRGB. `scene` outlives it.
  BaseColours(const aiScene& scene, bool colours_are_linear, FindFile find);

  // The mean over a triangle of what its material, its texture and its vertices say; of a texture
  // by its opaque part. Textures are pictures of at most 8192 pixels a side; others are as if they
  // were not there.
  Colour of(const aiMesh& mesh, const aiFace& face);

 private:
  struct Texture {
    int width = 0, height = 0;
    std::vector<uint8_t> rgba;
  };
  using Linear = Eigen::Array3d;

  const std::optional<Texture>& texture_of(unsigned material);
  std::optional<Texture> load(const std::string& name) const;
  Linear material_colour(unsigned material) const;
  Linear mean(const Texture& texture, const std::array<Eigen::Vector2d, 3>& corners) const;

  const aiScene& scene_;
  bool is_linear_;
  FindFile find_;
  std::vector<std::optional<std::optional<Texture>>> textures_;  // (material) once asked for
  std::array<double, 256> linear_;                               // of sRGB
};

}  // namespace pilesim
