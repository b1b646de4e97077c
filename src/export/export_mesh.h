// The mesh of a shape as other programs take it.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/types.h"
#include "render/render_mesh.h"
#include "trajectory/trajectory.h"

namespace pilesim {

// Points with all that vertices of graphics cards have: several at a crease, or where colours meet.
struct SplitMesh {
  std::vector<Vec3f> points, normals;        // m; unit
  std::vector<Vec3f> colours;                // of the file, linear; black where a texture is
  std::vector<std::array<float, 2>> places;  // in the texture, as TextureCorners has them
  std::vector<uint32_t> corners;             // (3 T) indices into points, in an order of its own
  std::vector<TextureRun> runs;              // of corners
};

struct ExportMesh {
  std::vector<Vec3f> points;      // m, body frame; no two at one place
  std::vector<uint32_t> corners;  // (3 T) indices into points
  std::vector<Vec3f> normals;     // (3 T) unit
  std::vector<Colour> colours;    // (T) of its file, or empty
  TextureMap texture_map;         // of the triangles, or empty
  SplitMesh split;
  float radius_m = 0;  // of the sphere about the origin that holds it
};

// A plane becomes a square about its origin that reaches `plane_reach_m` each way.
ExportMesh make_export_mesh(const TrajectoryShape& shape, float plane_reach_m);

// The textures of several meshes, each of them once.
class NumberedTextures {
 public:
  uint32_t number(const Texture& texture);               // 1 + index into all()
  std::vector<uint32_t> numbers(const TextureMap& map);  // of its triangles, 0: none
  const std::vector<const Texture*>& all() const { return all_; }

 private:
  std::vector<const Texture*> all_;
};

}  // namespace pilesim
