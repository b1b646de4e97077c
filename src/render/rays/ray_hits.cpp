#include "render/rays/ray_hits.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/parallel_for.h"
#include "render/rays/ray_scene.h"

namespace pilesim {
namespace {

// The near plane, in radii of the smallest body.
constexpr double kNearRadii = 1e-3;
// m, of scenes without bodies.
constexpr double kNearOfNothing = 1e-4;

// Columns or rows, from `first` up to `last`, not including it.
struct Span {
  int first = 0, last = 0;
};

// Pixels whose middles a sphere at (aside, z) may cover, within [low, high). `centre` and `focal`
// in pixels.
Span covered_span(double aside, double z, double radius, double focal, double centre, int low,
                  int high) {
  if (z - radius <= 0) return {low, high};
  // Bounds by the box about the sphere.
  const double nearest = focal / (z - radius), farthest = focal / (z + radius);
  const auto project = [&](double at) { return at * (at > 0 ? nearest : farthest) + centre; };
  const auto project_low = [&](double at) { return at * (at > 0 ? farthest : nearest) + centre; };
  const double first = std::clamp<double>(std::floor(project_low(aside - radius)) - 1, low, high);
  const double last = std::clamp<double>(std::ceil(project(aside + radius)) + 2, low, high);
  return {static_cast<int>(first), std::max(static_cast<int>(first), static_cast<int>(last))};
}

// m along the optical axis: what is nearer to the eye is not seen. By the smallest body.
double nearest_depth(const TrajectoryHeader& header) {
  double smallest = std::numeric_limits<double>::infinity();
  for (const TrajectoryShape& shape : header.shapes) {
    double radius = 0;
    for (const Vec3f& vertex : shape.vertices) radius = std::max<double>(radius, vertex.norm());
    if (radius > 0) smallest = std::min(smallest, radius);
  }
  return std::isfinite(smallest) ? kNearRadii * smallest : kNearOfNothing;
}

// The frame's bodies as they lie in the camera frame.
TrajectoryFrame in_camera(const TrajectoryFrame& frame, const Pinhole& camera) {
  TrajectoryFrame seen = frame;
  const Quat to_camera(camera.rotation);
  for (size_t body = 0; body < frame.position.size(); ++body) {
    seen.position[body] = camera.in_camera(frame.position[body]);
    seen.orientation[body] =
        (to_camera * frame.orientation[body].cast<double>().normalized()).cast<float>();
  }
  return seen;
}

// Where pixels lie that a body may cover whose origin is at `centre` in the camera frame and which
// reaches `radius` m from there. Empty where none is in the picture: of such a body nobody asks.
PixelBox silhouette_box(const Pinhole& camera, const Vec3& centre, double radius, double near_m) {
  if (centre.z() + radius <= near_m) return {};
  const int width = camera.width, height = camera.height;
  const Span columns =
      covered_span(centre.x(), centre.z(), radius, camera.fx, camera.cx, -width, 2 * width);
  const Span rows =
      covered_span(centre.y(), centre.z(), radius, camera.fy, camera.cy, -height, 2 * height);
  if (columns.first >= width || rows.first >= height || columns.last <= 0 || rows.last <= 0) {
    return {};
  }
  return {columns.first, rows.first, columns.last - columns.first, rows.last - rows.first};
}

}  // namespace

// All in the camera frame: floats are the finer the nearer to the eye.
struct RayHits::State {
  const TrajectoryHeader& header;
  RenderScene scene;
  RayScene traced;
  double near_m;
  Pinhole camera;
  TrajectoryFrame seen;

  explicit State(const TrajectoryHeader& told)
      : header(told),
        scene(header, BodyColours::own, MeshUse::hits),
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
        const RayHit& hit = met[column];
        const TrajectoryShape& shape = s.header.shapes[s.scene.shape[hit.body]];
        const size_t at = row * width + column;
        hits.instance[at] = hit.body + 1;
        hits.triangle[at] = hit.is_round
                                ? static_cast<uint32_t>(shape.triangles.size()) + hit.triangle
                                : triangle_at(shape, hit.triangle);
        hits.depth[at] = hit.distance;
      }
    }
  });
}

void RayHits::outline(size_t body, Silhouette& silhouette) {
  State& s = *state_;
  silhouette = {};
  silhouette.box = silhouette_box(s.camera, s.seen.position[body], s.scene.radius(body), s.near_m);
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
