// Which bodies are drawn in a frame, at which level of detail.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/types.h"
#include "render/body_colours.h"
#include "render/pattern.h"
#include "render/render_mesh.h"
#include "render/view.h"
#include "trajectory/trajectory.h"

namespace pilesim {

// Linear. The packed value is its square root.
inline Vec3f albedo_of(const PackedMaterial& packed) {
  return Vec3f(packed[0], packed[1], packed[2]).cwiseAbs2() / (255.0f * 255.0f);
}

// That the paint of a mesh's vertices holds, not the material's own colour.
bool is_painted(const PackedMaterial& material);

// The kind of a body's surface as surface.glsl has it.
uint8_t surface_kind(const TrajectoryHeader& header, size_t body);

// The input of a vertex shader for each body (body.vert).
struct Instance {
  Vec3f position;                    // m, world
  std::array<float, 4> orientation;  // x y z w
  PackedMaterial material;
  PatternCode pattern;
};
static_assert(sizeof(Instance) == 40);

// Instances of one level of one shape that lie one after another.
struct DrawBatch {
  uint32_t shape = 0;
  uint32_t level = 0;
  uint32_t first_instance = 0;
  uint32_t instance_count = 0;
};

// Where an instance is drawn at most, from its bounding sphere.
struct Footprint {
  // Pixels of the target, from its lower left corner.
  float left = 0, right = 0, bottom = 0, top = 0;
  float nearest = 0;               // least depth, as depth buffers have it; 0 or less: at the eye
  float away_m = 0, radius_m = 0;  // of its middle, along the view axis or the light
};

struct DrawList {
  std::vector<Instance> instances;
  std::vector<Footprint> footprints;  // as instances
  std::vector<DrawBatch> batches;
  uint64_t triangle_count = 0;
};

// The use that meshes are prepared for: pictures of triangles, pictures by rays, or finding by rays
// which triangle of the trajectory is in front. Rays meet round surfaces, not the triangles that
// stand for them.
enum class MeshUse : uint8_t { raster, rays, hits };

// Index into the shape's triangles of the one that is number `index` of those that no round surface
// replaces.
uint32_t triangle_at(const TrajectoryShape& shape, uint32_t index);

// The scene as the renderer keeps it, one entry a body or a shape of the trajectory.
struct RenderScene {
  std::vector<RenderMesh> meshes;        // (shape) without levels' triangles for planes
  std::vector<uint8_t> is_plane;         // (shape)
  std::vector<uint32_t> shape;           // (body)
  std::vector<PackedMaterial> material;  // (body)
  std::vector<PatternCode> pattern;      // (body) or none where no body has one
  std::vector<uint8_t> moves;            // (body)
  bool has_clear = false;                // some body lets light through
  float typical_radius_m = 1;            // median of the moving bodies' bounding radii
  BodyColours colours;
  // Where all coordinates in single precision count from, m, world; see view_origin().
  Vec3 origin = Vec3::Zero();

  explicit RenderScene(const TrajectoryHeader& header, BodyColours told = BodyColours::own,
                       MeshUse use = MeshUse::raster);
  PackedMaterial material_of(const TrajectoryFrame& frame, size_t body) const;
  // Where colours mean something, there is none.
  PatternCode pattern_of(const TrajectoryFrame& frame, size_t body) const;
  // m, from the origin. For a plane that is far from it, the nearest point of the plane.
  Vec3f place(const TrajectoryFrame& frame, size_t body) const;
  // m, from the origin: that of the body's frame, of a plane also.
  Vec3f anchor(const TrajectoryFrame& frame, size_t body) const {
    return (frame.position[body] - origin).cast<float>();
  }
  float radius(size_t body) const { return meshes[shape[body]].radius_m; }
  // Present and not a plane.
  bool drawn(const TrajectoryFrame& frame, size_t body) const {
    return (frame.state[body] & kPresent) != 0 && is_plane[shape[body]] == 0;
  }
};

// Opaque bodies in view, each at the coarsest level whose error is below `pixel_error` pixels of a
// picture of `width` x `height` pixels; from front to back within a batch.
void list_visible_bodies(const RenderScene& scene, const TrajectoryFrame& frame, const View& view,
                         float width, float height, float pixel_error, DrawList& list);

// The clear ones, from back to front, each as a batch of its own.
void list_clear_bodies(const RenderScene& scene, const TrajectoryFrame& frame, const View& view,
                       float width, float height, float pixel_error, DrawList& list);

// The box along the light that holds what is seen and casts shadows: the same for the same frame
// and view, and moving in whole texels of a map of `resolution` so that edges do not crawl.
// `to_light`: unit.
LightView fit_light_view(const RenderScene& scene, const TrajectoryFrame& frame, const View& view,
                         const Vec3f& to_light, int resolution);

// Bodies that cast shadows into `light`.
void list_shadow_casters(const RenderScene& scene, const TrajectoryFrame& frame,
                         const LightView& light, int resolution, DrawList& list);

}  // namespace pilesim
