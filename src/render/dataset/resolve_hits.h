// From the surface that is in front in each pixel to all that is told of it: computed from the
// trajectory's own triangles and round surfaces in double precision, so that it is exact.
#pragma once

#include <functional>

#include "render/pass_images.h"
#include "render/pinhole.h"
#include "render/rays/ray_hits.h"
#include "trajectory/trajectory.h"

namespace pilesim {

// A frame and the camera that sees it.
struct Moment {
  const TrajectoryFrame& frame;
  const Pinhole& camera;
};

// Adds to `hits` the planes that are nearer than what is there; of a plane only the side that its
// bodies lie on is seen. Fills all of `images` but its visibility. `next`: the moment of the
// trajectory's next frame, null where there is none.
void resolve_hits(const TrajectoryHeader& header, const Moment& now, const Moment* next,
                  SurfaceHits& hits, PassImages& images);

// Fills the visibility of `images` from what `renderer` sees at the moment of `images`. `take` is
// called for each body that covers at least a pixel of the picture alone, in ascending order.
using TakeSilhouette = std::function<void(size_t body, const Silhouette& alone)>;
void find_visibility(const TrajectoryHeader& header, const TrajectoryFrame& frame,
                     RayHits& renderer, PassImages& images, const TakeSilhouette& take = {});

}  // namespace pilesim
