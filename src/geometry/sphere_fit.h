// A solid as a few spheres: the dissertation's cheap stand-in (Tables 3.1 and 4.2 use seven).
#pragma once

#include <vector>

#include "geometry/mesh.h"

namespace pilesim {

struct FittedSphere {
  Vec3 centre;    // m, the frame of the mesh
  double radius;  // m, > 0
};

struct SphereFit {
  std::vector<FittedSphere> spheres;
  double volume_error = 0;          // (excess + missing) / mesh volume
  double mean_surface_error_m = 0;  // from the spheres' outer surface to the mesh's
};

// `count` >= 1 spheres that fill `mesh` (closed). Deterministic.
SphereFit fit_spheres(const TriangleMesh& mesh, int count);

}  // namespace pilesim
