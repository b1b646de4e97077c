// Contacts between the ellipsoids of bodies' moments, which represent bodies among others. They
// touch according to Berne and Pechukas' overlap of two Gaussians (J. Chem. Phys. 56, 4213, 1972).
// It is exact for balls, and for equal ellipsoids in equal orientation, such as plates in a stack.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/types.h"

namespace pilesim {

// x^T S x for a symmetric S of the squares of the semi-axes, m^2, world frame.
struct BodyEllipsoid {
  float xx = 0, yy = 0, zz = 0, xy = 0, xz = 0, yz = 0;
  float radius_m = 0;    // of a ball of its volume
  float shortest_m = 0;  // its shortest semi-axis
  bool is_ball = true;

  static BodyEllipsoid ball(float radius_m) {
    const float square = radius_m * radius_m;
    return {square, square, square, 0, 0, 0, radius_m, radius_m, true};
  }
  // Its extent along a unit vector, m.
  float support_m(const Vec3f& n) const {
    if (is_ball) return radius_m;
    const float square = n.x() * n.x() * xx + n.y() * n.y() * yy + n.z() * n.z() * zz +
                         2 * (n.x() * n.y() * xy + n.x() * n.z() * xz + n.y() * n.z() * yz);
    return std::sqrt(std::max(square, shortest_m * shortest_m));
  }
};

// The ellipsoids of one kind of bodies, as the image of a ball of radius 1.
struct EllipsoidForm {
  Eigen::Matrix3f squares = Eigen::Matrix3f::Identity();  // body frame, determinant 1
  float longest = 1, shortest = 1;                        // semi-axes

  BodyEllipsoid placed(const Quatf& orientation, float radius_m) const {
    const Eigen::Matrix3f turn = orientation.toRotationMatrix();
    const Eigen::Matrix3f s = radius_m * radius_m * (turn * squares * turn.transpose());
    return {s(0, 0), s(1, 1), s(2, 2), s(0, 1), s(0, 2), s(1, 2), radius_m, shortest * radius_m,
            false};
  }
};

struct EllipsoidContact {
  Vec3f normal;        // unit, towards a
  float gap;           // m, along it
  float arm_a, arm_b;  // m, distance from each centre along it
  // Its shortest semi-axis over its extent along the normal, 0 .. 1: 1 for a body that lies flat
  // there, small for one on its edge or end.
  float flatness_a, flatness_b;
};

inline EllipsoidContact contact_of_balls(float a_m, float b_m, const Vec3f& apart) {
  const float distance = apart.norm();
  // For coincident centres the order decides.
  const Vec3f normal = distance > 0 ? Vec3f(apart / distance) : Vec3f::UnitY();
  return {normal, distance - a_m - b_m, a_m, b_m, 1, 1};
}

// The contact of two ellipsoids nearer than `reach_m`, and possibly of slightly farther ones.
// `apart`: from b to a, m.
inline std::optional<EllipsoidContact> contact_of(const BodyEllipsoid& a, const BodyEllipsoid& b,
                                                  const Vec3f& apart, float reach_m) {
  if (a.is_ball && b.is_ball) return contact_of_balls(a.radius_m, b.radius_m, apart);
  // In double: long, thin bodies leave hardly a digit of a float.
  const double xx = double{a.xx} + b.xx, yy = double{a.yy} + b.yy, zz = double{a.zz} + b.zz;
  const double xy = double{a.xy} + b.xy, xz = double{a.xz} + b.xz, yz = double{a.yz} + b.yz;
  const double cxx = yy * zz - yz * yz, cxy = xz * yz - xy * zz, cxz = xy * yz - xz * yy;
  const double cyy = xx * zz - xz * xz, cyz = xy * xz - xx * yz, czz = xx * yy - xy * xy;
  const double determinant = xx * cxx + xy * cxy + xz * cxz;
  const Vec3 way = apart.cast<double>();
  const Vec3 slope = Vec3(cxx * way.x() + cxy * way.y() + cxz * way.z(),
                          cxy * way.x() + cyy * way.y() + cyz * way.z(),
                          cxz * way.x() + cyz * way.y() + czz * way.z()) /
                     determinant;
  // Balls of any two sizes touch as balls.
  const double sum = double{a.radius_m} + b.radius_m;
  const double squares = double{a.radius_m} * a.radius_m + double{b.radius_m} * b.radius_m;
  const double balls = sum * sum / (2 * squares);
  const double scale2 = way.dot(slope) / (2 * balls);  // 1 at contact
  // The gap is at least that along the shortest axes, whatever the two sizes.
  const double farthest = 1 + 1.4143 * reach_m / (double{a.shortest_m} + b.shortest_m);
  if (scale2 > farthest * farthest) return {};
  const double length = slope.norm();
  if (!(determinant > 0 && scale2 > 0 && length > 0)) {
    return contact_of_balls(a.radius_m, b.radius_m, apart);
  }
  const double scale = std::sqrt(scale2);
  const auto gap = static_cast<float>(2 * balls * scale * (scale - 1) / length);
  const Vec3f normal = (slope / length).cast<float>();
  // Divides the distance between them.
  const float reach_a = a.support_m(normal), reach_b = b.support_m(normal);
  const float arms = std::max(apart.dot(normal) - gap, 0.0F) / (reach_a + reach_b);
  return EllipsoidContact{
      normal, gap, arms * reach_a, arms * reach_b, a.shortest_m / reach_a, b.shortest_m / reach_b};
}

}  // namespace pilesim
