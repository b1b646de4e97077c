#include "geometry/round_sector.h"

#include <cmath>

namespace pilesim {

RoundSector RoundSector::cylinder(double radius, double height) {
  return frustum(radius, radius, height);
}

RoundSector RoundSector::frustum(double bottom, double top, double height) {
  return {.bottom = bottom, .top = top, .height = height};
}

double RoundSector::radius_at(double y) const {
  return height > 0 ? bottom + (top - bottom) * (y / height + 0.5) : bottom;
}

bool RoundSector::is_within(const Vec3& direction) const {
  return is_whole() ||
         direction.x() >= std::cos(half_angle) * std::hypot(direction.x(), direction.z());
}

Vec3 RoundSector::side_normal(const Vec3& direction) const {
  const double across = std::hypot(direction.x(), direction.z());
  const double rise = bottom - top;  // over the height
  const double slope = std::hypot(height, rise);
  const double outward = slope > 0 ? height / slope : 1, upward = slope > 0 ? rise / slope : 0;
  return {outward * direction.x() / across, upward, outward * direction.z() / across};
}

Vec3 RoundSector::farthest(const Vec3& direction) const {
  const double across = std::hypot(direction.x(), direction.z());
  // The arcs' points at this angle.
  double x = 1, z = 0, along = 0;
  const bool is_inside = is_within(direction);
  if (is_inside && across > 1e-12 * std::abs(direction.y())) {
    x = direction.x() / across;
    z = direction.z() / across;
    along = across;
  } else if (!is_inside) {
    x = std::cos(half_angle);
    z = std::copysign(std::sin(half_angle), direction.z());
    along = x * direction.x() + z * direction.z();
  } else if (is_whole()) {
    x = 0;
  }
  const double up = direction.y() * height / 2;
  const bool is_top = up + top * along > -up + bottom * along || (along == 0 && up > 0);
  const double radius = is_top ? top : bottom, y = (is_top ? 0.5 : -0.5) * height;
  Vec3 point(radius * x, y, radius * z);
  if (is_whole() || hole == 0) return point;
  const double end_x = std::cos(half_angle);
  const double end_z = std::copysign(std::sin(half_angle), direction.z());
  const Vec3 inner(hole * end_x, std::copysign(height / 2, direction.y()), hole * end_z);
  return inner.dot(direction) > point.dot(direction) ? inner : point;
}

}  // namespace pilesim
