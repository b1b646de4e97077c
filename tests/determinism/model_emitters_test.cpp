// The unrolled bodies of a scene, bit for bit: the same on every run and with any thread count.
#include <gtest/gtest.h>

#include "core/hash.h"
#include "core/parallel_for.h"
#include "geometry/primitives.h"
#include "model/emitters.h"

namespace pilesim {
namespace {

std::string bodies_hash() {
  const TriangleMesh ball = sphere_mesh(1);
  Emitter disk{.shapes = {"a"}, .source = DiskSource{.radius = 2, .height = 4}, .count = 500};
  disk.position_jitter_m = 0.01;
  disk.linear_velocity_jitter = 1;
  disk.angular_velocity_jitter = 1;
  const Emitter volume{.shapes = {"a"}, .source = VolumeSource{.spacing = 0.1}};
  Hasher hasher;
  for (const auto& bodies :
       {unroll(disk, 3, 42, 0.1, nullptr), unroll(volume, 4, 42, 0.1, &ball)}) {
    for (const EmittedBody& body : bodies) {
      const Quat& q = body.pose.orientation;
      const std::array<double, 13> values = {body.pose.position.x(),
                                             body.pose.position.y(),
                                             body.pose.position.z(),
                                             q.w(),
                                             q.x(),
                                             q.y(),
                                             q.z(),
                                             body.linear_velocity.x(),
                                             body.linear_velocity.y(),
                                             body.linear_velocity.z(),
                                             body.angular_velocity.x(),
                                             body.angular_velocity.y(),
                                             body.angular_velocity.z()};
      hasher.add_values(std::span<const double>(values));
    }
  }
  return hasher.digest();
}

TEST(EmittersDeterminism, TheSameBitsForAnyThreadCount) {
  set_thread_count(1);
  const std::string serial = bodies_hash();
  set_thread_count(4);
  EXPECT_EQ(bodies_hash(), serial);
  EXPECT_EQ(bodies_hash(), serial);
}

}  // namespace
}  // namespace pilesim
