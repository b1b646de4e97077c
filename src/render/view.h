// The view of a camera, as matrices and planes. View space: x right, y up, looking along -z.
#pragma once

#include <array>

#include "core/types.h"
#include "scene/scene.h"

namespace pilesim {

struct View {
  Eigen::Matrix4f clip_from_world;
  Vec3f eye, right, up, forward;  // world
  float tan_half_width = 1;       // of the field of view
  float tan_half_height = 1;
  float near_m = 0.1f, far_m = 100;
  float focus_m = 1;                                 // from the eye to the camera's target
  Eigen::Vector2f offset = Eigen::Vector2f::Zero();  // of the picture, of half its size
  std::array<Eigen::Vector4f, 5> planes;  // n.p + d >= 0 inside: left, right, bottom, top, near

  float depth_of(const Vec3f& point) const { return forward.dot(point - eye); }
  bool sees_sphere(const Vec3f& centre, float radius) const;
  // Whether it sees a sphere on its way from `a` to `b`.
  bool sees_capsule(const Vec3f& a, const Vec3f& b, float radius) const;
  // Column and row (from the top) of a point in front of the eye, in pixels of a picture of that
  // size; the middle of the first pixel is (0.5, 0.5).
  Eigen::Vector2f project(const Vec3f& point, float width, float height) const;
  // From (column, row from the bottom, 1) in pixels to the ray there, 1 m long along `forward`.
  Eigen::Matrix3f world_from_image(float width, float height) const;
  // Moves the picture right and up by shares of half its size: less than what the planes, which
  // stay, leave out.
  void shift(float x, float y);
};

// Where coordinates in single precision of what a camera sees count from, m, world, and the camera
// as it is from there.
Vec3 view_origin(const CameraKey& camera);
CameraKey from_origin(CameraKey camera, const Vec3& origin);
// The upward direction of the picture but for the camera's roll: y, or -z where it looks straight
// up or down.
Vec3 above(const CameraKey& camera);
View make_view(const CameraKey& camera, float aspect, float near_m, float far_m);

// The shadow map's frame: an orthographic box along the light.
struct LightView {
  Eigen::Matrix4f shadow_from_world;  // the box to [0,1]^3, z away from the light
  Vec3f extent = Vec3f::Ones();       // m, edges of the box
  float margin_m = 1;                 // from the box's sides to what was fitted: shadows fade there
};

// World to the light's axes (x right, y up, z away from the light: left-handed, as depth is).
// `to_light`: unit, not y itself.
Eigen::Matrix3f light_from_world(const Vec3f& to_light);
// `low` and `high` in the light's axes.
LightView make_light_view(const Vec3f& to_light, const Vec3f& low, const Vec3f& high);

}  // namespace pilesim
