// Indexed triangle meshes, in metres, in the frame of the file they came from.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "core/colour.h"
#include "core/texture.h"
#include "core/types.h"

namespace pilesim {

using Triangle = std::array<uint32_t, 3>;  // vertex indices, counter-clockwise from outside

// A named run of triangles (an OBJ group or object). Convex parts are recognised by such groups.
struct MeshGroup {
  std::string name;
  uint32_t first_triangle = 0;
  uint32_t triangle_count = 0;
};

struct TriangleMesh {
  std::vector<Vec3> vertices;       // (V) m
  std::vector<Triangle> triangles;  // (T) indices below V
  std::vector<MeshGroup> groups;    // disjoint, ordered, covering all triangles; empty: one unnamed
  std::vector<Colour> colours;      // (T) drawn ones; empty: the file has none
  TextureMap texture_map;           // drawn in place of colours, where there are textures
  // How far the digits that the vertices were written with may have moved each of them, m; 0 where
  // nothing is known of it.
  double rounding_m = 0;
  // Textures of the file that could not be read, one a material: which, and why; the colours are
  // those without it. Names are as the file has them.
  std::vector<std::string> lost_textures;

  Bounds bounds() const;
};

// Whether it is a sheet rather than a solid, with cracks or without: whether its areas, as vectors,
// do not add up to nothing.
bool is_sheet(const TriangleMesh& mesh);

// Takes a mesh whose z is up to one whose y is: (x, y, z) becomes (x, z, -y), exactly.
void turn_z_up_to_y_up(TriangleMesh& mesh);

// XXH3 of vertices and triangles (not of group names): names the decomposition cache.
std::string mesh_hash(const TriangleMesh& mesh);

}  // namespace pilesim
