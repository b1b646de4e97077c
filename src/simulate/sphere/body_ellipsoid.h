// How far apart two bodies come to lie: by the ellipsoids of their moments, which stand for bodies
// among others. Two touch where Berne and Pechukas' overlap of two Gaussians says so (J. Chem.
// Phys. 56, 4213, 1972), which is exact for balls, and for ellipsoids of one form that lie alike,
// as plates in a stack do.
#pragma once

#include <cmath>
#include <optional>

#include "core/types.h"

namespace pilesim {

// x^T S x for a symmetric S of the squares of the semi-axes, m^2, world frame.
struct BodyEllipsoid {
  float xx = 0, yy = 0, zz = 0, xy = 0, xz = 0, yz = 0;
  float radius_m = 0;    // of the ball of its volume
  float shortest_m = 0;  // its shortest semi-axis

  static BodyEllipsoid ball(float radius_m) {
    const float square = radius_m * radius_m;
    return {square, square, square, 0, 0, 0, radius_m, radius_m};
  }
};

// The ellipsoids of one kind of bodies, as a ball of radius 1 that is stretched.
struct EllipsoidForm {
  Eigen::Matrix3f squares = Eigen::Matrix3f::Identity();  // body frame, of determinant 1
  float longest = 1, shortest = 1;                        // semi-axes

  BodyEllipsoid placed(const Quatf& orientation, float radius_m) const {
    const Eigen::Matrix3f turn = orientation.toRotationMatrix();
    const Eigen::Matrix3f s = radius_m * radius_m * (turn * squares * turn.transpose());
    return {s(0, 0), s(1, 1), s(2, 2), s(0, 1), s(0, 2), s(1, 2), radius_m, shortest * radius_m};
  }
};

struct EllipsoidContact {
  Vec3f normal;  // unit, towards a
  float gap;     // m, along it
};

// Of two that are nearer than `reach_m`, and perhaps of some that are not. `apart`: from b to a, m.
inline std::optional<EllipsoidContact> contact_of(const BodyEllipsoid& a, const BodyEllipsoid& b,
                                                  const Vec3f& apart, float reach_m) {
  const float xx = a.xx + b.xx, yy = a.yy + b.yy, zz = a.zz + b.zz;
  const float xy = a.xy + b.xy, xz = a.xz + b.xz, yz = a.yz + b.yz;
  const float cxx = yy * zz - yz * yz, cxy = xz * yz - xy * zz, cxz = xy * yz - xz * yy;
  const float cyy = xx * zz - xz * xz, cyz = xy * xz - xx * yz, czz = xx * yy - xy * xy;
  const float determinant = xx * cxx + xy * cxy + xz * cxz;
  const Vec3f slope = Vec3f(cxx * apart.x() + cxy * apart.y() + cxz * apart.z(),
                            cxy * apart.x() + cyy * apart.y() + cyz * apart.z(),
                            cxz * apart.x() + cyz * apart.y() + czz * apart.z()) /
                      determinant;
  // So that balls of any two sizes touch as balls.
  const float sum = a.radius_m + b.radius_m;
  const float balls = sum * sum / (2 * (a.radius_m * a.radius_m + b.radius_m * b.radius_m));
  const float scale2 = apart.dot(slope) / (2 * balls);  // 1 where they touch
  // The gap is at least as wide as along the shortest axes, whatever the two sizes.
  const float farthest = 1 + 1.4143F * reach_m / (a.shortest_m + b.shortest_m);
  if (scale2 > farthest * farthest) return {};
  const float length = slope.norm();
  // Of two in one place the order decides.
  if (!(length > 0)) return EllipsoidContact{Vec3f::UnitY(), -sum};
  const float scale = std::sqrt(scale2);
  return EllipsoidContact{slope / length, 2 * balls * scale * (scale - 1) / length};
}

}  // namespace pilesim
