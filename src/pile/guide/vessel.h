// A guide as a vessel to fill upside down: its base is open.
#pragma once

#include <array>
#include <vector>

#include "core/philox.h"
#include "geometry/mesh.h"

namespace pilesim {

// The guide without its base, and walls that continue from its rim. m, world frame.
struct Vessel {
  TriangleMesh walls;
  std::vector<std::array<Vec3, 3>> base;  // triangles; empty: the guide has no level base
  std::vector<std::array<Vec3, 2>> rim;   // edges
  double base_m2 = 0;
  double level_m = 0;   // of the base, upwards
  double height_m = 0;  // of the guide above it
};

// `up` is unit; the walls continue for `chute_m` below the base.
Vessel open_guide(const TriangleMesh& guide, const Vec3& up, double chute_m);

// Uniform over the base; of kCandidates random points the first that is `clearance_m` from the rim,
// else the one farthest from it.
Vec3 drop_point(const Vessel& vessel, double clearance_m, Philox draws);

}  // namespace pilesim
