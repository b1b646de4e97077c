// The base colours and textures that a mesh file gives its triangles: of materials, pictures and
// vertices, as assimp has read them. Runs where mesh files are read (geometry/mesh_file.h).
#pragma once

#include <assimp/scene.h>

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/colour.h"
#include "core/texture.h"
#include "core/types.h"

namespace pilesim {

class BaseColours {
 public:
  // The bytes of a file by the name that the mesh file gives it; null where there is none.
  using FindFile = std::function<const std::string*(const std::string& name)>;

  // `colours_are_linear`: those of materials and vertices; else they are sRGB. `scene` outlives it.
  BaseColours(const aiScene& scene, bool colours_are_linear, FindFile find);

  // The mean over a triangle of the colours of its material, its texture and its vertices. A
  // texture counts by its opaque part. Textures are pictures of at most 8192 pixels a side; others
  // are as if they were not there, and lost() says so.
  Colour of(const aiMesh& mesh, const aiFace& face);
  // Adds the face to map(): where it lies in its texture, whose pixels are multiplied by the
  // material's colour, and see-through ones filled with the mean of the others. None where it has
  // no texture that can be read, or where its vertices have colours besides: then its mean stands.
  void place(const aiMesh& mesh, const aiFace& face, bool mirrored);
  TextureMap& map() { return map_; }
  // For each requested material whose texture could not be read: which, and why. Names are those of
  // the file.
  const std::vector<std::string>& lost() const { return lost_; }

 private:
  struct Picture {
    int width = 0, height = 0;
    std::vector<uint8_t> rgba;
  };
  struct Skin {  // of a material
    std::optional<Picture> picture;
    unsigned channel = 0;  // of the texture coordinates
    uint32_t texture = 0;  // 1 + index into those of the map; 0: not yet there
  };
  struct Unreadable {
    std::string why;
  };
  using Linear = Eigen::Array3d;

  Skin& skin_of(unsigned material);
  // Null where it has none.
  const aiVector3D* coordinates(const aiMesh& mesh, const Skin& skin) const;
  // Throws Unreadable.
  Picture load(const std::string& name) const;
  Linear material_colour(unsigned material) const;
  // The factor of a texture.
  Linear factor(unsigned material) const;
  Linear mean(const Picture& picture, const std::array<Eigen::Vector2d, 3>& corners) const;
  uint32_t keep(const Picture& picture, const Linear& factor);

  const aiScene& scene_;
  bool is_linear_;
  FindFile find_;
  std::vector<std::optional<Skin>> skins_;  // (material) once asked for
  TextureMap map_;
  std::vector<std::string> lost_;
  std::array<double, 256> linear_;  // of sRGB
};

}  // namespace pilesim
