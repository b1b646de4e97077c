// The plane that cuts a part in two whose convex hulls have the least volume.
#pragma once

#include "geometry/mesh_clip.h"

namespace pilesim {

struct Cut {
  ClipPlane plane;
  double hull_volume_m3 = 0;  // of both sides together
};

// Tries planes across axes of the body and through its reentrant edges and improves the best ones
// by small tilts and shifts. Where none saves much, as of a ring or a tube, the one after which a
// second cut of each side saves most. Deterministic, runs in parallel.
Cut best_cut(const FacetedSolid& solid);

}  // namespace pilesim
