// The bodies of a frame as rays meet them: full meshes and round surfaces, each once in memory, and
// planes. Embree finds what is met; only ray_scene.cpp and round_geometry.cpp know it.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <span>

#include "core/types.h"
#include "render/draw_list.h"

namespace pilesim {

inline constexpr uint32_t kNoBody = std::numeric_limits<uint32_t>::max();

struct Ray {
  Vec3f origin = Vec3f::Zero();     // m, world axes, from the scene's origin
  Vec3f direction = Vec3f::Zero();  // world, of any length: distances are counted in it
  float nearest = 0;
  float farthest = std::numeric_limits<float>::infinity();
  float time = 0.5f;  // when in the shutter's interval, [0, 1]
  float below = 0;    // m, how far behind a plane's front it may start and still meet it
  float spread = 0;   // how wide what it stands for is, m, for each unit of distance
};

struct RayHit {
  float distance = std::numeric_limits<float>::infinity();
  uint32_t body = kNoBody;
  uint32_t triangle = 0;  // of the full mesh, or its round surface; planes have none
  bool is_round = false;
  float u = 0, v = 0;  // weights of the triangle's second and third corner
};

// The surface that a ray has hit. Normals are units, world, and point to where the ray came from.
struct RaySurface {
  Vec3f position = Vec3f::Zero();  // m, world axes, from the scene's origin
  Vec3f geometric_normal = Vec3f::Zero();
  Vec3f normal = Vec3f::Zero();  // smooth
  // Where further rays start: off the surface, and on the smooth one that the triangles stand for,
  // so that their edges do not show in its shadows (Hanika, "Hacking the Shadow Terminator", 2021).
  Vec3f start = Vec3f::Zero();
  // Those that go through it start here: as far off its other side.
  Vec3f beyond() const { return position - off_m * geometric_normal; }
  float off_m = 0;
  Vec3f paint = Vec3f::Zero();    // linear, of its triangle or texture, where the mesh has such
  Vec3f pattern = Vec3f::Ones();  // factor of its colour
  bool closed = false;            // of a closed mesh,
  bool inside = false;            // and the ray is about to leave it
};

// Where the bodies are while the shutter is open: from half of `share` of a frame before its time
// to as much after it. Without neighbours, or where a body is not present there, it stands still.
struct Shutter {
  const TrajectoryFrame* before = nullptr;
  const TrajectoryFrame* after = nullptr;
  float share = 0;  // [0, 1]
  bool moves() const { return share > 0 && (before != nullptr || after != nullptr); }
};

class RayScene {
 public:
  // `scene` outlives it. Throws Error(internal) where Embree does not start.
  explicit RayScene(const RenderScene& scene);
  ~RayScene();
  RayScene(const RayScene&) = delete;
  RayScene& operator=(const RayScene&) = delete;

  // Both frames outlive what is asked afterwards. The same whatever was placed before.
  void place(const TrajectoryFrame& frame, const Shutter& shutter);

  // The first thing that each ray meets, planes from their front only. `coherent`: neighbours among
  // the rays go about the same way.
  void closest(std::span<const Ray> rays, std::span<RayHit> hits, bool coherent) const;
  // 1 where a body is between `nearest` and `farthest`, 0 otherwise. Planes block nothing.
  void blocked(std::span<const Ray> rays, std::span<uint8_t> result, bool coherent) const;
  // Whom meets() is about, until something is placed or singled out again.
  void single_out(uint32_t body);
  // 1 where the body singled out is between `nearest` and `farthest`, whatever else is there: where
  // closest() would meet it if it were alone. 0 everywhere of planes and of what is not placed.
  void meets(std::span<const Ray> rays, std::span<uint8_t> result) const;
  // For a ray that has hit something.
  RaySurface surface(const Ray& ray, const RayHit& hit) const;
  // The plane that a ray comes to if no body is in its way, or kNoBody.
  uint32_t plane_before(const Ray& ray) const;
  Vec3f plane_normal(uint32_t body) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace pilesim
