// Hits by rays: one through each pixel's middle.
#pragma once

#include <memory>

#include "render/hit_renderer.h"

namespace pilesim {

class RayHits final : public HitRenderer {
 public:
  // Throws Error(internal) where Embree does not start.
  explicit RayHits(const TrajectoryHeader& header);
  ~RayHits() override;
  RayHits(const RayHits&) = delete;
  RayHits& operator=(const RayHits&) = delete;

  void look(const TrajectoryFrame& frame, const Pinhole& camera) override;
  void find_hits(SurfaceHits& hits) override;
  void outline(size_t body, Silhouette& silhouette) override;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace pilesim
