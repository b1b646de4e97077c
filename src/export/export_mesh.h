// The mesh of a shape, for other programs.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/types.h"
#include "render/render_mesh.h"
#include "trajectory/trajectory.h"

namespace pilesim {

// Points with all attributes of a graphics vertex: several per position at creases and colour
// borders.
struct SplitMesh {
  std::vector<Vec3f> points, normals;  // m; unit
  std::vector<Vec3f> colours;          // from the file, linear; black where there is a texture
  std::vector<std::array<float, 2>> places;  // texture coordinates, as in TextureCorners
  std::vector<uint32_t> corners;             // (3 T) indices into points, in its own order
  std::vector<TextureRun> runs;              // runs of corners
};

struct ExportMesh {
  std::vector<Vec3f> points;      // m, body frame; all different
  std::vector<uint32_t> corners;  // (3 T) indices into points
  std::vector<Vec3f> normals;     // (3 T) unit
  std::vector<Colour> colours;    // (T) from its file, or empty
  TextureMap texture_map;         // of the triangles, or empty
  SplitMesh split;
  float radius_m = 0;  // of the smallest sphere about the origin that contains it
};

// A plane becomes a square about its origin that extends `plane_reach_m` in each direction.
ExportMesh make_export_mesh(const TrajectoryShape& shape, float plane_reach_m);

// The textures of several meshes, without repetitions.
class NumberedTextures {
 public:
  uint32_t number(const Texture& texture);               // 1 + index into all()
  std::vector<uint32_t> numbers(const TextureMap& map);  // per triangle, 0: none
  const std::vector<const Texture*>& all() const { return all_; }

 private:
  std::vector<const Texture*> all_;
};

}  // namespace pilesim
