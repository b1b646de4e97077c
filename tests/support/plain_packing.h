// A packing by geometry alone, as for particles, for tests without piles.
#pragma once

#include <algorithm>
#include <cmath>

#include "geometry/convex_hull.h"
#include "geometry/mass_properties.h"
#include "signature/signature.h"

namespace pilesim::test {

// `mesh`: of the signature's body, m.
inline Packing plain_packing(const Signature& signature, const TriangleMesh& mesh) {
  const SignatureBody& body = signature.body;
  double lowest_m = body.outer_radius_m;
  for (const KnownRestPose& pose : signature.rest_poses) {
    lowest_m = std::min(lowest_m, pose.height_m);
  }
  const double hull_m3 = mass_properties(convex_hull(mesh.vertices)).volume_m3;
  const double packed_m3 = body.volume_m3 * std::pow(hull_m3 / body.volume_m3, 0.35);
  const double radius_m = std::cbrt(3 * packed_m3 / (4 * kPi));
  return {.pours = 1,
          .radius_m = radius_m,
          .rolling = 0.35 * (1 - lowest_m / body.outer_radius_m),
          .turning = 1,
          .leaning = 0.1};
}

}  // namespace pilesim::test
