#include "render/scene_view.h"

#include <algorithm>

namespace pilesim {

View scene_view(const RenderScene& scene, const TrajectoryFrame& frame, const CameraKey& camera,
                int width, int height) {
  const float aspect = static_cast<float>(width) / static_cast<float>(height);
  const auto distance = static_cast<float>((camera.target - camera.position).norm());
  const View rough = make_view(camera, aspect, 1e-4f * distance, 1e4f * distance);
  float nearest = 0.2f * distance;
  float farthest = distance;
  for (size_t body = 0; body < scene.shape.size(); ++body) {
    if (!scene.drawn(frame, body)) continue;
    const float radius = scene.radius(body);
    const Vec3f place = scene.place(frame, body);
    if (!rough.sees_sphere(place, radius)) continue;
    const float depth = rough.depth_of(place);
    nearest = std::min(nearest, depth - radius);
    farthest = std::max(farthest, depth + radius);
  }
  nearest = std::max(0.9f * nearest, 0.01f * distance);
  return make_view(camera, aspect, nearest, std::max(2 * farthest, 400 * distance));
}

float fade_distance(const RenderScene& scene, const TrajectoryFrame& frame, const View& view) {
  float distance = 3 * view.focus_m;
  for (size_t body = 0; body < scene.shape.size(); ++body) {
    if (scene.is_plane[scene.shape[body]] == 0 || (frame.state[body] & kPresent) == 0) continue;
    const Vec3f normal = frame.orientation[body] * Vec3f(0, 1, 0);
    distance = std::max(distance, 8 * normal.dot(view.eye - scene.place(frame, body)));
  }
  return distance;
}

}  // namespace pilesim
