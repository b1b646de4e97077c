// Cuts a solid into parts that are nearly convex: the search behind decompose().
#pragma once

#include <vector>

#include "geometry/mesh_clip.h"

namespace pilesim {

struct PartitionOptions {
  int max_parts = 32;        // >= 1
  double max_excess_m3 = 0;  // enough when the hulls exceed the parts by less in all
  double max_depth_m = 0;    // and cover no hollow deeper, see hollow_depth.h; 0: or any
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
  // found it on its way down, without its later changes to the resulting parts. Never empty.
  std::vector<double> excess_with_more;
  // The deepest hollow, above max_depth_m, that is left as there may be no more parts, m; else 0.
  double hollow_m = 0;
};

// Few parts that fill `solid` (closed) and do not overlap; nor do their hulls, but for a little.
// First the part with the largest excess is cut in two again and again, beyond the number of parts
// that is allowed; then the pairs whose joint hull adds least are merged; then the cuts between
// neighbours are searched again and merges traded for cuts while that helps; then parts whose hulls
// cover deep hollows are cut, as far as there may be more. Deterministic.
ConvexPartition partition_into_convex(const FacetedSolid& solid, const PartitionOptions& options);

}  // namespace pilesim
