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
  // were not there, and lost() says so.
  Colour of(const aiMesh& mesh, const aiFace& face);
  // Of each material that was asked for whose texture could not be read: which, and why. Names are
  // those of the file.
  const std::vector<std::string>& lost() const { return lost_; }

 private:
  struct Texture {
    int width = 0, height = 0;
    std::vector<uint8_t> rgba;
  };
  struct Unreadable {
    std::string why;
  };
  using Linear = Eigen::Array3d;

  const std::optional<Texture>& texture_of(unsigned material);
  // Throws Unreadable.
  Texture load(const std::string& name) const;
  Linear material_colour(unsigned material) const;
  Linear mean(const Texture& texture, const std::array<Eigen::Vector2d, 3>& corners) const;

  const aiScene& scene_;
  bool is_linear_;
  FindFile find_;
  std::vector<std::optional<std::optional<Texture>>> textures_;  // (material) once asked for
  std::vector<std::string> lost_;
  std::array<double, 256> linear_;  // of sRGB
};

}  // namespace pilesim
