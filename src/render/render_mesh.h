// Meshes made ready for drawing: normals with crisp creases, textures and levels of detail.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/colour.h"
#include "core/round_surface.h"
#include "core/texture.h"
#include "core/types.h"
#include "render/mip_map.h"

namespace pilesim {

// Colour and kind as the shaders have them (surface.glsl), 255 for 1.
using PackedMaterial = std::array<uint8_t, 4>;

PackedMaterial pack_material(const Colour& colour, uint8_t kind);

struct RenderVertex {
  std::array<float, 3> position;  // m, body frame
  std::array<float, 3> normal;    // unit, body frame
  // Its triangle's own, for bodies that are painted; its kind is 0 where the mesh has no colours.
  PackedMaterial paint = {0, 0, 0, 0};
  // The texture of its triangle, in place of paint: 1 + index into the mesh's, 0: none; and the
  // place in it.
  uint32_t texture = 0;
  std::array<float, 2> uv = {0, 0};
};

// Indices of one level whose triangles have one texture.
struct TextureRun {
  uint32_t texture = 0;  // as that of the triangles' last vertices
  uint32_t first_index = 0;
  uint32_t index_count = 0;
};

// One level of detail: a run of the mesh's vertices and indices of its own.
struct MeshLevel {
  uint32_t first_index = 0;
  uint32_t index_count = 0;
  uint32_t first_vertex = 0;  // indices count from here
  // Distance of its surface, and of what textures show on it, from the full mesh's.
  float error_m = 0;
  std::vector<TextureRun> runs;  // all of its indices
};

struct RenderMesh {
  std::vector<RenderVertex> vertices;
  std::vector<uint32_t> indices;
  std::vector<MeshLevel> levels;  // >= 1, from the full mesh to the coarsest
  std::vector<std::shared_ptr<const MipMap>> textures;
  std::vector<RoundSurface> round;  // surfaces that belong to it beside its triangles
  float radius_m = 0;               // of the sphere about the body's origin that holds it
  bool closed = false;              // every edge has two triangles of opposite directions
  // Mean length of its part of straight lines that go through it, 4 V / S (Cauchy); 0: not closed.
  float mean_chord_m = 0;
};

// Triangles in the order in which they are told, without those that have two corners at one place.
struct CornerMesh {
  std::vector<Vec3f> positions;   // no two the same
  std::vector<uint32_t> corners;  // (3 T) indices into positions
  std::vector<Vec3f> normals;     // (3 T) as make_render_mesh() has them
  std::vector<uint32_t> source;   // (T) which of the triangles it is
};

CornerMesh make_corner_mesh(std::span<const Vec3f> vertices,
                            std::span<const std::array<uint32_t, 3>> triangles);

// `colours`: one a triangle, or none; `map`: of the triangles, or empty; the result's own
// `textures` are the caller's to fill, in its order. Triangles meet smoothly where the angle
// between them is below the crease angle. Vertices at the same place are one. Simplified levels use
// vertices of the full mesh with their normals.
RenderMesh make_render_mesh(std::span<const Vec3f> vertices,
                            std::span<const std::array<uint32_t, 3>> triangles,
                            std::span<const Colour> colours = {}, const TextureMap& map = {});

// The triangles as they are told, in their order: one level, with no normals to shade by.
RenderMesh make_plain_mesh(std::span<const Vec3f> vertices,
                           std::span<const std::array<uint32_t, 3>> triangles);

// Angle between faces above which their common edge is drawn sharp.
inline constexpr double kCreaseAngle = radians(38);

}  // namespace pilesim
