// The cone x0 >= |(x1, x2, x3)| with the operations of an interior point method in Nesterov and
// Todd's scaling. Cones of fewer dimensions are embedded: components that are zero stay zero.
#pragma once

#include <algorithm>
#include <cmath>

#include "core/types.h"

namespace pilesim::cone {

using Vec4 = Eigen::Vector4d;
using Mat4 = Eigen::Matrix4d;

inline double square(const Vec4& x) {  // > 0 inside
  const double tail = x.tail<3>().norm();
  return (x[0] - tail) * (x[0] + tail);
}

inline Vec4 product(const Vec4& u, const Vec4& v) {
  Vec4 result;
  result << u.dot(v), u[0] * v.tail<3>() + v[0] * u.tail<3>();
  return result;
}

// The v with product(u, v) = w, for u inside.
inline Vec4 quotient(const Vec4& w, const Vec4& u) {
  Vec4 result;
  result[0] = (u[0] * w[0] - u.tail<3>().dot(w.tail<3>())) / square(u);
  result.tail<3>() = (w.tail<3>() - result[0] * u.tail<3>()) / u[0];
  return result;
}

// The largest step <= 1 along `way`, from x inside, that stays in the cone.
inline double most_step(const Vec4& x, const Vec4& way) {
  // square(x + t way) = c + 2 b t + a t^2
  const double a = way[0] * way[0] - way.tail<3>().squaredNorm();
  const double b = x[0] * way[0] - x.tail<3>().dot(way.tail<3>());
  const double c = square(x);
  double step = 1;
  const double root = b * b - a * c;
  if (root >= 0) {
    // The smaller positive root, without cancellation.
    const double q = -(b + std::copysign(std::sqrt(root), b));
    for (const double t : {q / a, c / q}) {
      if (t > 0) step = std::min(step, t);
    }
  }
  if (way[0] < 0) step = std::min(step, -x[0] / way[0]);
  return step;
}

// W with W s = W^-1 x = `scaled`.
struct Scaling {
  Mat4 w, inverse, square;
  Vec4 scaled;

  Scaling() = default;
  Scaling(const Vec4& x, const Vec4& s) {
    const double size_x = std::sqrt(cone::square(x)), size_s = std::sqrt(cone::square(s));
    const Vec4 unit_x = x / size_x;
    Vec4 mirrored = s / size_s;
    const double gamma = std::sqrt((1 + unit_x.dot(mirrored)) / 2);
    mirrored.tail<3>() *= -1;
    const Vec4 point = (unit_x + mirrored) / (2 * gamma);
    const double eta = std::sqrt(size_x / size_s);
    const Vec3 tail = point.tail<3>();
    const Mat3 block = Mat3::Identity() + tail * tail.transpose() / (1 + point[0]);
    w << point[0], tail.transpose(), tail, block;
    inverse << point[0], -tail.transpose(), -tail, block;
    w *= eta;
    inverse /= eta;
    square = w * w;
    scaled = w * s;
  }
};

}  // namespace pilesim::cone
