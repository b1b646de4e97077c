#include "render/hit_renderer.h"

#include <algorithm>
#include <cmath>
#include <limits>

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

// Of pixels whose middles a sphere at (aside, z) may cover, within [low, high). `centre` and
// `focal` in pixels.
Span covered_span(double aside, double z, double radius, double focal, double centre, int low,
                  int high) {
  if (z - radius <= 0) return {low, high};
  // Of the box about the sphere.
  const double nearest = focal / (z - radius), farthest = focal / (z + radius);
  const auto project = [&](double at) { return at * (at > 0 ? nearest : farthest) + centre; };
  const auto project_low = [&](double at) { return at * (at > 0 ? farthest : nearest) + centre; };
  const double first = std::clamp<double>(std::floor(project_low(aside - radius)) - 1, low, high);
  const double last = std::clamp<double>(std::ceil(project(aside + radius)) + 2, low, high);
  return {static_cast<int>(first), std::max(static_cast<int>(first), static_cast<int>(last))};
}

}  // namespace

double nearest_depth(const TrajectoryHeader& header) {
  double smallest = std::numeric_limits<double>::infinity();
  for (const TrajectoryShape& shape : header.shapes) {
    double radius = 0;
    for (const Vec3f& vertex : shape.vertices) radius = std::max<double>(radius, vertex.norm());
    if (radius > 0) smallest = std::min(smallest, radius);
  }
  return std::isfinite(smallest) ? kNearRadii * smallest : kNearOfNothing;
}

TrajectoryFrame in_camera(const TrajectoryFrame& frame, const Pinhole& camera) {
  TrajectoryFrame seen = frame;
  const Quat to_camera(camera.rotation);
  for (size_t body = 0; body < frame.position.size(); ++body) {
    seen.position[body] = camera.in_camera(frame.position[body].cast<double>()).cast<float>();
    seen.orientation[body] =
        (to_camera * frame.orientation[body].cast<double>().normalized()).cast<float>();
  }
  return seen;
}

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

}  // namespace pilesim
