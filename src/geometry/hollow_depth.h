// How deep the hollows are that the convex hull of a part covers.
#pragma once

#include "geometry/convex_partition.h"

namespace pilesim {

// The deepest that a point of the part's surface lies below its hull, m: along the outward normal
// there, or as far as the part's surface opposite if that is nearer. So a notch counts by its depth
// or its width, however thin the part is to both sides. Hollows that are not deeper than `least_m`
// count as 0, and so do the cuts of the partition. Looked at in the middle and near the corners of
// each face; where that is very often, at some of them.
double hollow_depth(const ConvexPart& part, double least_m);

}  // namespace pilesim
