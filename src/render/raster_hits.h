// Hits by OpenGL: one sample a pixel, at its middle.
#pragma once

#include <memory>

#include "render/hit_renderer.h"

namespace pilesim {

class RasterHits : public HitRenderer {
 public:
  // `header` stays. Throws Error(internal) if no OpenGL 3.3 core context can be made, Error(usage)
  // for a size that it cannot draw.
  RasterHits(const TrajectoryHeader& header, int width, int height);
  ~RasterHits() override;
  RasterHits(const RasterHits&) = delete;
  RasterHits& operator=(const RasterHits&) = delete;

  // `camera` is of this renderer's size.
  void look(const TrajectoryFrame& frame, const Pinhole& camera) override;
  void find_hits(SurfaceHits& hits) override;
  void outline(size_t body, Silhouette& silhouette) override;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace pilesim
