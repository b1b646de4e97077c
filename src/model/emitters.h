// Emitters unrolled into single bodies.
#pragma once

#include <cstdint>
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
};

// The bodies of emitter number `emitter_index` of a scene, in the order in which they start. Each
// body draws its own random numbers from (seed, emitter, body), so the result depends on nothing
// else. `bounding_radius` (m, >= 0) is the largest of the emitter's shapes: a disk keeps bodies
// that start together two of them apart while there is room. `volume_mesh` is the mesh of a volume
// in metres, in its own frame, closed; null for other sources. A volume without a count ends at one
// body more than a scene may have. Throws Error(input) without a file if a volume's spacing gives
// more than 10^8 lattice points.
std::vector<EmittedBody> unroll(const Emitter& emitter, size_t emitter_index, uint64_t seed,
                                double bounding_radius, const TriangleMesh* volume_mesh);

}  // namespace pilesim
