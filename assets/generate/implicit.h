// Building blocks of implicit surfaces: a field is negative inside, positive outside and close to
// the distance (m) near the surface. Shapes are blended from ellipsoids and round cones.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>

#include "core/types.h"

namespace pilesim {

using Field = std::function<double(const Vec3&)>;

inline double sphere(const Vec3& point, const Vec3& centre, double radius) {
  return (point - centre).norm() - radius;
}

// Axis-aligned; first-order distance.
inline double ellipsoid(const Vec3& point, const Vec3& centre, const Vec3& radii) {
  const Vec3 scaled = (point - centre).cwiseQuotient(radii);
  const double slope = scaled.cwiseQuotient(radii).norm();
  const double length = scaled.norm();
  return slope > 0 ? length * (length - 1) / slope : -radii.minCoeff();
}

// `axes` takes the ellipsoid's own axes to the frame of `point`.
inline double ellipsoid(const Vec3& point, const Vec3& centre, const Vec3& radii,
                        const Quat& axes) {
  return ellipsoid(axes.conjugate() * (point - centre), Vec3::Zero(), radii);
}

// Hull of two spheres; exact. The axis is longer than the difference of the radii.
inline double round_cone(const Vec3& point, const Vec3& start, const Vec3& end, double start_radius,
                         double end_radius) {
  const Vec3 axis = end - start;
  const double length = axis.norm();
  const double along = (point - start).dot(axis) / length;
  const double across = std::sqrt(std::max((point - start).squaredNorm() - along * along, 0.0));
  const double sine = (start_radius - end_radius) / length;
  const double nearest =
      std::clamp((along - across * sine / std::sqrt(1 - sine * sine)) / length, 0.0, 1.0);
  return (point - start - nearest * axis).norm() -
         (start_radius + nearest * (end_radius - start_radius));
}

// Blends two solids; the seam is rounded over about `blend` metres.
inline double smooth_union(double a, double b, double blend) {
  const double overlap = std::max(blend - std::abs(a - b), 0.0) / blend;
  return std::min(a, b) - overlap * overlap * blend / 4;
}

// Takes `cutter` away from `solid`.
inline double smooth_cut(double solid, double cutter, double blend) {
  return -smooth_union(-solid, cutter, blend);
}

inline double smooth_intersection(double a, double b, double blend) {
  return -smooth_union(-a, -b, blend);
}

inline Quat rotation(double angle_degrees, const Vec3& axis) {
  return Quat(Eigen::AngleAxisd(radians(angle_degrees), axis));
}

}  // namespace pilesim
