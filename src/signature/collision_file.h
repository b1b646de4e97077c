// Collisions of an object with a plane, measured or simulated, as a CSV file.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/types.h"

namespace pilesim {

// In any right-handed axes that do not turn. Velocities are the centre of mass's, m/s; spins rad/s.
struct PlaneCollision {
  Vec3 normal = Vec3::UnitY();  // unit, from the plane to the body
  Vec3 velocity_before = Vec3::Zero();
  Vec3 spin_before = Vec3::Zero();
  Vec3 velocity_after = Vec3::Zero();
  Vec3 spin_after = Vec3::Zero();
};

struct CollisionFile {
  std::vector<PlaneCollision> collisions;
  std::vector<std::string> ignored;  // columns that mean nothing here
};

// The first line names the columns, in any order (docs/signatures.md); each line behind it is a
// collision. Throws Error(input) with the lines and values that are wrong, the first 50 of them.
CollisionFile read_collisions(const std::filesystem::path& file);
void write_collisions(const std::vector<PlaneCollision>& collisions,
                      const std::filesystem::path& file);

}  // namespace pilesim
