// Cuts a solid into parts that are nearly convex: the search behind decompose().
#pragma once

#include <vector>

#include "geometry/mesh_clip.h"

namespace pilesim {

struct PartitionOptions {
  int max_parts = 32;              // >= 1
  double max_excess_m3 = 0;        // stop when the hulls' volumes exceed the parts' by less
};

struct ConvexPart {
  FacetedSolid solid;
  double volume_m3 = 0;
  double hull_volume_m3 = 0;
  std::vector<Vec3> hull_points;  // the vertices of its hull, m

  double excess() const { return hull_volume_m3 - volume_m3; }
};

// The parts fill `solid` (closed) and do not overlap; their hulls overlap little. Deterministic.
// Lengths are expected near 1: scale the solid so that its bounds are.
std::vector<ConvexPart> partition_into_convex(const FacetedSolid& solid,
                                              const PartitionOptions& options);

}  // namespace pilesim
