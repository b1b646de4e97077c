// Emitters unrolled into single bodies.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/types.h"
#include "geometry/mesh.h"
#include "scene/scene.h"

namespace pilesim {

struct EmittedBody {
  Pose pose;                             // of the body frame (centre of mass) in the world
  Vec3 linear_velocity = Vec3::Zero();   // m/s
  Vec3 angular_velocity = Vec3::Zero();  // rad/s, world frame
  double start_s = 0;
  uint32_t shape = 0;  // index into emitter.shapes
  double size = 1;     // times the shape's own
  std::optional<Colour> colour;
  std::optional<double> roughness, clear_coat;
};

// The sizes that bodies of these can have, ascending from `from` to `to`.
std::vector<double> size_steps(const Sizes& sizes);

// The bodies of emitter number `emitter_index` of a scene, in the order in which they start. Each
// body draws its own random numbers from (seed, emitter, body), so the result depends on nothing
// else. `bounding_radius` (m, >= 0) is the largest of the emitter's shapes and sizes: a disk keeps
// bodies that start together two of them apart while there is room. `volume_mesh` is the mesh of a
// volume in metres, in its own frame, closed; null for other sources. A volume without a count ends
// at one body more than a scene may have. Throws Error(input) without a file if a volume's spacing
// gives more than 10^8 lattice points.
std::vector<EmittedBody> unroll(const Emitter& emitter, size_t emitter_index, uint64_t seed,
                                double bounding_radius, const TriangleMesh* volume_mesh);

// Its bodies start at random places, of which another one is as good.
bool can_be_drawn_again(const Emitter& emitter);

// Another pose at random for a body of such an emitter, the same for the same `draw` (below 1000).
// It has the orientation that unroll() gives it where that is not random.
Pose drawn_again(const Emitter& emitter, size_t emitter_index, uint64_t seed, size_t body,
                 uint32_t draw);

}  // namespace pilesim
