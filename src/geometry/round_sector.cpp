#include "geometry/round_sector.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace pilesim {
namespace {

double across_axis(const Vec3& direction) {
  return std::sqrt(direction.x() * direction.x() + direction.z() * direction.z());
}

}  // namespace

RoundSector RoundSector::cylinder(double radius, double height) {
  return frustum(radius, radius, height);
}

RoundSector RoundSector::frustum(double bottom, double top, double height) {
  return {.bottom = bottom, .top = top, .height = height};
}

RoundSector RoundSector::part(double half_angle) const {
  RoundSector part = *this;
  part.end_x = std::cos(half_angle);
  part.end_z = std::sin(half_angle);
  return part;
}

double RoundSector::half_angle() const { return std::atan2(end_z, end_x); }

double RoundSector::radius_at(double y) const {
  return height > 0 ? bottom + (top - bottom) * (y / height + 0.5) : bottom;
}

bool RoundSector::is_within(const Vec3& direction) const {
  return is_whole() || direction.x() >= end_x * across_axis(direction);
}

Vec3 RoundSector::side_normal(const Vec3& direction) const {
  const double across = across_axis(direction);
  const double rise = bottom - top;  // over the height
  const double slope = std::hypot(height, rise);
  const double outward = slope > 0 ? height / slope : 1, upward = slope > 0 ? rise / slope : 0;
  return {outward * direction.x() / across, upward, outward * direction.z() / across};
}

Vec3 RoundSector::farthest(const Vec3& direction) const {
  const double across = across_axis(direction);
  // The arcs' points at this angle.
  double x = 1, z = 0, along = 0;
  const bool is_inside = is_whole() || direction.x() >= end_x * across;
  if (is_inside && across > 1e-12 * std::abs(direction.y())) {
    x = direction.x() / across;
    z = direction.z() / across;
    along = across;
  } else if (!is_inside) {
    x = end_x;
    z = std::copysign(end_z, direction.z());
    along = x * direction.x() + z * direction.z();
  } else if (is_whole()) {
    x = 0;
  }
  const double up = direction.y() * height / 2;
  const bool is_top = up + top * along > -up + bottom * along || (along == 0 && up > 0);
  const double radius = is_top ? top : bottom, y = (is_top ? 0.5 : -0.5) * height;
  Vec3 point(radius * x, y, radius * z);
  if (is_whole() || height == 0) return point;
  const Vec3 inner(hole * end_x, std::copysign(height / 2, direction.y()),
                   std::copysign(hole * end_z, direction.z()));
  return inner.dot(direction) > point.dot(direction) ? inner : point;
}

SectorFaces flat_faces(const RoundSector& sector, double turn) {
  constexpr double kRounding = 1e-9;  // an arc gets no corner more for it
  const double half_angle = sector.half_angle();
  const bool is_whole = sector.is_whole(), is_flat = sector.height == 0;
  const auto steps = static_cast<uint32_t>(std::ceil(2 * half_angle / turn - kRounding));
  SectorFaces faces;
  std::array<std::vector<uint32_t>, 2> ends;  // lower and upper
  for (size_t i = 0; i < (is_flat ? 1 : 2); ++i) {
    const double radius = i == 0 ? sector.bottom : sector.top;
    const auto add = [&](double distance, double angle) {
      ends[i].push_back(static_cast<uint32_t>(faces.corners.size()));
      faces.corners.emplace_back(distance * std::cos(angle), (i == 0 ? -0.5 : 0.5) * sector.height,
                                 distance * std::sin(angle));
    };
    const uint32_t count = radius == 0 ? 1 : is_whole ? steps : steps + 1;
    for (uint32_t k = 0; k < count; ++k) add(radius, half_angle * (2.0 * k / steps - 1));
    if (is_whole || is_flat) continue;
    add(sector.hole, half_angle);
    add(sector.hole, -half_angle);
  }
  if (is_flat) return faces;
  // The angle turns from x to z: counter-clockwise as seen from below.
  auto& [lower, upper] = ends;
  if (!is_whole) {
    const size_t count = lower.size();
    for (size_t a = count - 3; a < count; ++a) {
      const size_t b = (a + 1) % count;
      faces.loops.push_back({lower[b], lower[a], upper[a], upper[b]});
    }
  }
  std::ranges::reverse(upper);
  for (const std::vector<uint32_t>& end : ends) {
    if (end.size() > 2) faces.loops.push_back(end);
  }
  return faces;
}

}  // namespace pilesim
