// Which surface is in front in each pixel, from whatever finds it.
#pragma once

#include <cstddef>
#include <cstdint>
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

class HitRenderer {
 public:
  virtual ~HitRenderer() = default;
  // What the calls below see, until the next call of this.
  virtual void look(const TrajectoryFrame& frame, const Pinhole& camera) = 0;
  // Of full meshes; planes may be left out: resolve_hits() knows where they are.
  virtual void find_hits(SurfaceHits& hits) = 0;
  // Of a body that is present and no plane. In the picture it covers what it does in find_hits()
  // where nothing is before it.
  virtual void outline(size_t body, Silhouette& silhouette) = 0;
};

}  // namespace pilesim
