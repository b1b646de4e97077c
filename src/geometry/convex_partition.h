// Cuts a solid into parts that are nearly convex: the search behind decompose().
#pragma once

#include <vector>

#include "geometry/mesh_clip.h"

namespace pilesim {

struct PartitionOptions {
  int max_parts = 32;        // >= 1
  double max_excess_m3 = 0;  // enough when the hulls exceed the parts by less in all
};

struct ConvexPart {
  FacetedSolid solid;
  double volume_m3 = 0;
  double hull_volume_m3 = 0;
  std::vector<Vec3> hull_points;  // the vertices of its hull, m

  double excess() const { return hull_volume_m3 - volume_m3; }
};

struct ConvexPartition {
  std::vector<ConvexPart> parts;
  // By how much the hulls exceed max_parts, max_parts + 1, ... parts in all, m^3, as the search
  // found it on its way down; what it did then with the parts that it gives is not in it. Never
  // empty.
  std::vector<double> excess_with_more;
};

// Few parts that fill `solid` (closed) and do not overlap; nor do their hulls, but for a little.
// First the part with the largest excess is cut in two again and again, beyond the number of parts
// that is allowed; then the pairs whose joint hull adds least are merged; then the cuts between
// neighbours are searched anew and merges traded for cuts while that helps. Deterministic.
ConvexPartition partition_into_convex(const FacetedSolid& solid, const PartitionOptions& options);

}  // namespace pilesim
