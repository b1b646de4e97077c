// Collisions of an object with a plane, measured or simulated, as a CSV file.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/types.h"

namespace pilesim {

// Any right-handed, non-rotating axes. Velocities of the centre of mass in m/s, spins in rad/s.
struct PlaneCollision {
  Vec3 normal = Vec3::UnitY();  // unit, from the plane to the body
  Vec3 velocity_before = Vec3::Zero();
  Vec3 spin_before = Vec3::Zero();
  Vec3 velocity_after = Vec3::Zero();
  Vec3 spin_after = Vec3::Zero();
};

struct CollisionFile {
  std::vector<PlaneCollision> collisions;
  std::vector<std::string> ignored;  // columns without a meaning here
};

// The first line names the columns, in any order (docs/signatures.md); each further line is a
// collision. Throws Error(input) that lists the first 50 wrong values with their lines.
CollisionFile read_collisions(const std::filesystem::path& file);
void write_collisions(const std::vector<PlaneCollision>& collisions,
                      const std::filesystem::path& file);

}  // namespace pilesim
