// Which surface is in front in each pixel, and what each body would cover alone: by a ray through
// each pixel's middle, in full meshes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "render/pass_images.h"
#include "render/pinhole.h"
#include "trajectory/trajectory.h"

namespace pilesim {

// The pixels that a body covers if nothing else is there, in the picture and up to its width and
// height beyond each of its sides.
struct Silhouette {
  PixelBox box;  // holds all that is covered; may begin at negative columns and rows
  std::vector<uint8_t> covered;  // (box.height, box.width) 1 or 0
};

class RayHits {
 public:
  // `header` outlives it. Throws Error(internal) where Embree does not start.
  explicit RayHits(const TrajectoryHeader& header);
  ~RayHits();
  RayHits(const RayHits&) = delete;
  RayHits& operator=(const RayHits&) = delete;

  // Sets the frame and camera of the calls below, until the next call.
  void look(const TrajectoryFrame& frame, const Pinhole& camera);
  // Planes are left out: resolve_hits() knows where they are.
  void find_hits(SurfaceHits& hits);
  // For a body that is present and no plane. It covers the same pixels as in find_hits() where
  // nothing is before it.
  void outline(size_t body, Silhouette& silhouette);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace pilesim
