// Which surface is in front in each pixel, from whatever finds it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "render/pass_images.h"
#include "render/pinhole.h"
#include "trajectory/trajectory.h"

namespace pilesim {

// The near plane, m along the optical axis: what is nearer to the eye is not seen. By the smallest
// body.
double nearest_depth(const TrajectoryHeader& header);

// The frame's bodies as they lie in the camera frame.
TrajectoryFrame in_camera(const TrajectoryFrame& frame, const Pinhole& camera);

// What a body covers if nothing else is there, in the picture and up to its width and height beyond
// each of its sides.
struct Silhouette {
  PixelBox box;  // holds all that is covered; may begin at negative columns and rows
  std::vector<uint8_t> covered;  // (box.height, box.width) 1 or 0
};

// Where pixels lie that a body may cover whose origin is at `centre` in the camera frame and which
// reaches `radius` m from there. Empty where none is in the picture: of such a body nobody asks.
PixelBox silhouette_box(const Pinhole& camera, const Vec3& centre, double radius, double near_m);

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
