// Meshes made ready for drawing: normals with crisp creases and levels of detail.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/types.h"

namespace pilesim {

struct RenderVertex {
  std::array<float, 3> position;  // m, body frame
  std::array<float, 3> normal;    // unit, body frame
};

// One level of detail: a run of the mesh's vertices and indices of its own.
struct MeshLevel {
  uint32_t first_index = 0;
  uint32_t index_count = 0;
  uint32_t first_vertex = 0;  // indices count from here
  float error_m = 0;          // distance of its surface from the full mesh's
};

struct RenderMesh {
  std::vector<RenderVertex> vertices;
  std::vector<uint32_t> indices;
  std::vector<MeshLevel> levels;  // >= 1, from the full mesh to the coarsest
  float radius_m = 0;             // of the sphere about the body's origin that holds it
  bool closed = false;            // every edge has two triangles of opposite directions
};

// Triangles meet smoothly where the angle between them is below the crease angle. Vertices at the
// same place are one. Simplified levels use vertices of the full mesh with their normals.
RenderMesh make_render_mesh(std::span<const Vec3f> vertices,
                            std::span<const std::array<uint32_t, 3>> triangles);

// Angle between faces above which their common edge is drawn sharp.
inline constexpr double kCreaseAngle = radians(38);

}  // namespace pilesim
