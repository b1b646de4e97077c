#include "render/view.h"

#include <algorithm>
#include <cmath>

#include "core/near_origin.h"

namespace pilesim {

bool View::sees_sphere(const Vec3f& centre, float radius) const {
  return sees_capsule(centre, centre, radius);
}

bool View::sees_capsule(const Vec3f& a, const Vec3f& b, float radius) const {
  return std::all_of(planes.begin(), planes.end(), [&](const Eigen::Vector4f& plane) {
    const Vec3f normal = plane.head<3>();
    return std::max(normal.dot(a), normal.dot(b)) + plane.w() >= -radius;
  });
}

Eigen::Vector2f View::project(const Vec3f& point, float width, float height) const {
  const Eigen::Vector4f clip = clip_from_world * point.homogeneous();
  return {(0.5f + 0.5f * clip.x() / clip.w()) * width,
          (0.5f - 0.5f * clip.y() / clip.w()) * height};
}

Eigen::Matrix3f View::world_from_image(float width, float height) const {
  const Vec3f across = tan_half_width * right;
  const Vec3f upward = tan_half_height * up;
  Eigen::Matrix3f matrix;
  matrix.col(0) = 2 / width * across;
  matrix.col(1) = 2 / height * upward;
  matrix.col(2) = forward - (1 + offset.x()) * across - (1 + offset.y()) * upward;
  return matrix;
}

void View::shift(float x, float y) {
  clip_from_world.row(0) += x * clip_from_world.row(3);
  clip_from_world.row(1) += y * clip_from_world.row(3);
  offset += Eigen::Vector2f(x, y);
}

Vec3 view_origin(const CameraKey& camera) {
  return near_origin(camera.target, (camera.target - camera.position).norm());
}

CameraKey from_origin(CameraKey camera, const Vec3& origin) {
  camera.position -= origin;
  camera.target -= origin;
  return camera;
}

Vec3 above(const CameraKey& camera) {
  const Vec3 forward = (camera.target - camera.position).normalized();
  return std::abs(forward.y()) > 0.9999 ? Vec3(0, 0, -1) : Vec3(0, 1, 0);
}

View make_view(const CameraKey& camera, float aspect, float near_m, float far_m) {
  View view;
  view.eye = camera.position.cast<float>();
  view.forward = (camera.target - camera.position).normalized().cast<float>();
  view.right = view.forward.cross(above(camera).cast<float>()).normalized();
  view.up = view.right.cross(view.forward);
  if (camera.roll != 0) {
    const Eigen::AngleAxisf roll(static_cast<float>(camera.roll), view.forward);
    view.right = roll * view.right;
    view.up = roll * view.up;
  }
  view.tan_half_height = static_cast<float>(std::tan(0.5 * camera.field_of_view));
  view.tan_half_width = view.tan_half_height * aspect;
  view.near_m = near_m;
  view.far_m = far_m;
  view.focus_m = static_cast<float>((camera.target - camera.position).norm());

  Eigen::Matrix4f view_from_world = Eigen::Matrix4f::Identity();
  view_from_world.block<1, 3>(0, 0) = view.right.transpose();
  view_from_world.block<1, 3>(1, 0) = view.up.transpose();
  view_from_world.block<1, 3>(2, 0) = -view.forward.transpose();
  view_from_world.block<3, 1>(0, 3) = -view_from_world.block<3, 3>(0, 0) * view.eye;
  Eigen::Matrix4f clip_from_view = Eigen::Matrix4f::Zero();
  clip_from_view(0, 0) = 1 / view.tan_half_width;
  clip_from_view(1, 1) = 1 / view.tan_half_height;
  clip_from_view(2, 2) = -(far_m + near_m) / (far_m - near_m);
  clip_from_view(2, 3) = -2 * far_m * near_m / (far_m - near_m);
  clip_from_view(3, 2) = -1;
  view.clip_from_world = clip_from_view * view_from_world;
  const auto [shift_right, shift_up] = camera.lens_shift;
  if (shift_right != 0 || shift_up != 0) {
    view.shift(static_cast<float>(-2 * shift_right), static_cast<float>(-2 * shift_up) * aspect);
  }

  const auto plane = [&](const Vec3f& inward) {
    const Vec3f normal = inward.normalized();
    return Eigen::Vector4f(normal.x(), normal.y(), normal.z(), -normal.dot(view.eye));
  };
  const Vec3f x = view.tan_half_width * view.forward;
  const Vec3f y = view.tan_half_height * view.forward;
  view.planes = {plane((1 + view.offset.x()) * x + view.right),
                 plane((1 - view.offset.x()) * x - view.right),
                 plane((1 + view.offset.y()) * y + view.up),
                 plane((1 - view.offset.y()) * y - view.up), plane(view.forward)};
  view.planes[4].w() -= near_m;
  return view;
}

Eigen::Matrix3f light_from_world(const Vec3f& to_light) {
  const Vec3f away = -to_light;
  const Vec3f right = away.cross(Vec3f(0, 1, 0)).normalized();
  Eigen::Matrix3f rotation;
  rotation.row(0) = right.transpose();
  rotation.row(1) = right.cross(away).transpose();
  rotation.row(2) = away.transpose();
  return rotation;
}

LightView make_light_view(const Vec3f& to_light, const Vec3f& low, const Vec3f& high) {
  LightView light;
  light.extent = high - low;
  const Vec3f scale = light.extent.cwiseInverse();
  light.shadow_from_world.setIdentity();
  light.shadow_from_world.block<3, 3>(0, 0) = scale.asDiagonal() * light_from_world(to_light);
  light.shadow_from_world.block<3, 1>(0, 3) = -low.cwiseProduct(scale);
  return light;
}

}  // namespace pilesim
