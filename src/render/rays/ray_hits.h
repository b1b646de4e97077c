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

// What a body covers if nothing else is there, in the picture and up to its width and height beyond
// each of its sides.
struct Silhouette {
  PixelBox box;  // holds all that is covered; may begin at negative columns and rows
  std::vector<uint8_t> covered;  // (box.height, box.width) 1 or 0
};

class RayHits {
 public:
  // Throws Error(internal) where Embree does not start.
  explicit RayHits(const TrajectoryHeader& header);
  ~RayHits();
  RayHits(const RayHits&) = delete;
  RayHits& operator=(const RayHits&) = delete;

  // What the calls below see, until the next call of this.
  void look(const TrajectoryFrame& frame, const Pinhole& camera);
  // Planes are left out: resolve_hits() knows where they are.
  void find_hits(SurfaceHits& hits);
  // Of a body that is present and no plane. In the picture it covers what it does in find_hits()
  // where nothing is before it.
  void outline(size_t body, Silhouette& silhouette);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace pilesim
