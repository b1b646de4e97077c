#include "render/rays/ray_hits.h"

#include "core/parallel_for.h"
#include "render/rays/ray_scene.h"

namespace pilesim {

// All in the camera frame: floats are the finer the nearer to the eye.
struct RayHits::State {
  RenderScene scene;
  RayScene traced;
  double near_m;
  Pinhole camera;
  TrajectoryFrame seen;

  explicit State(const TrajectoryHeader& header)
      : scene(header, BodyColours::own, MeshUse::hits),
        traced(scene),
        near_m(nearest_depth(header)) {}

  // Through the middles of a row's pixels from `column` on. Distances along them are depths.
  void aim(int column, int row, std::vector<Ray>& rays) const {
    for (Ray& ray : rays) {
      ray = {.direction = camera.ray(column++, row).cast<float>(),
             .nearest = static_cast<float>(near_m)};
    }
  }
};

RayHits::RayHits(const TrajectoryHeader& header) : state_(std::make_unique<State>(header)) {}
RayHits::~RayHits() = default;

void RayHits::look(const TrajectoryFrame& frame, const Pinhole& camera) {
  State& s = *state_;
  s.camera = camera;
  s.seen = in_camera(frame, camera);
  for (size_t body = 0; body < s.scene.shape.size(); ++body) {
    // resolve_hits() knows where planes are.
    if (s.scene.is_plane[s.scene.shape[body]] != 0) s.seen.state[body] = 0;
  }
  s.traced.place(s.seen, {});
}

void RayHits::find_hits(SurfaceHits& hits) {
  const State& s = *state_;
  hits.resize(s.camera.width, s.camera.height);
  const auto width = static_cast<size_t>(s.camera.width);
  parallel_for(static_cast<size_t>(s.camera.height), 1, [&](size_t begin, size_t end) {
    std::vector<Ray> rays(width);
    std::vector<RayHit> met(width);
    for (size_t row = begin; row < end; ++row) {
      s.aim(0, static_cast<int>(row), rays);
      s.traced.closest(rays, met, true);
      for (size_t column = 0; column < width; ++column) {
        if (met[column].body == kNoBody) continue;
        hits.instance[row * width + column] = met[column].body + 1;
        hits.triangle[row * width + column] = met[column].triangle;
      }
    }
  });
}

void RayHits::outline(size_t body, Silhouette& silhouette) {
  State& s = *state_;
  silhouette = {};
  silhouette.box = silhouette_box(s.camera, s.seen.position[body].cast<double>(),
                                  s.scene.radius(body), s.near_m);
  const PixelBox& box = silhouette.box;
  if (box.width == 0) return;
  const auto width = static_cast<size_t>(box.width), height = static_cast<size_t>(box.height);
  silhouette.covered.resize(width * height);
  s.traced.single_out(static_cast<uint32_t>(body));
  parallel_for(height, 8, [&](size_t begin, size_t end) {
    std::vector<Ray> rays(width);
    for (size_t row = begin; row < end; ++row) {
      s.aim(box.column, box.row + static_cast<int>(row), rays);
      s.traced.meets(rays, std::span(silhouette.covered).subspan(row * width, width));
    }
  });
}

}  // namespace pilesim
