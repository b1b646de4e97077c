#include "render/pinhole.h"

#include <cmath>
#include <cstdint>
#include <limits>

#include "render/view.h"

namespace pilesim {

Pinhole make_pinhole(const CameraKey& camera, int width, int height) {
  Pinhole pinhole{.width = width, .height = height};
  pinhole.fx = pinhole.fy = 0.5 * height / std::tan(0.5 * camera.field_of_view);
  // The picture lies right and up of the axis, the axis left and down of its middle.
  pinhole.cx = 0.5 * (width - 1) - camera.lens_shift[0] * width;
  pinhole.cy = 0.5 * (height - 1) + camera.lens_shift[1] * width;
  const Vec3 forward = (camera.target - camera.position).normalized();
  const Eigen::AngleAxisd roll(camera.roll, forward);
  const Vec3 right = roll * forward.cross(above(camera)).normalized();
  pinhole.rotation.row(0) = right.transpose();
  pinhole.rotation.row(1) = forward.cross(right).transpose();
  pinhole.rotation.row(2) = forward.transpose();
  pinhole.translation = -(pinhole.rotation * camera.position);
  return pinhole;
}

double depth_unit_mm(const CameraKey& camera) {
  const double reach_mm = 4000 * (camera.target - camera.position).norm();
  const double finest = reach_mm / std::numeric_limits<uint16_t>::max();
  const double decade = std::pow(10, std::floor(std::log10(finest)));
  for (const double step : {1, 2, 5}) {
    if (step * decade >= finest) return step * decade;
  }
  return 10 * decade;
}

}  // namespace pilesim
