#include "geometry/round_crossings.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace pilesim {
namespace {

using Vec2 = Eigen::Vector2d;  // (radius, y)

double square(double x) { return x * x; }

// Positive where `point` is on the left of the line from `from` along `along`.
double side_of(const Vec2& along, const Vec2& from, const Vec2& point) {
  return along.x() * (point.y() - from.y()) - along.y() * (point.x() - from.x());
}

// The circle of an arc.
struct ArcCircle {
  Vec2 centre;
  double radius;
};

ArcCircle circle_of(const Vec2& from, const Vec2& to, double bulge) {
  const Vec2 along = to - from;
  const double length = along.norm();
  const double radius = length / 4 * (bulge + 1 / bulge);
  const Vec2 right(along.y() / length, -along.x() / length);
  return {(from + to) / 2 + (bulge * length / 2 - radius) * right, radius};
}

// The real roots of a polynomial, coefficients from that of 1 upward, where its sign changes within
// [low, high]; ascending. Between two roots of the derivative there is one at most.
template <size_t size>
size_t roots_between(const std::array<double, size>& c, double low, double high,
                     std::array<double, size>& roots) {
  const auto value = [&](double x) {
    double sum = 0;
    for (size_t i = size; i-- > 0;) sum = sum * x + c[i];
    return sum;
  };
  std::array<double, size + 1> ends;
  size_t count = 0;
  ends[count++] = low;
  if constexpr (size > 2) {
    std::array<double, size - 1> slope, turns;
    for (size_t i = 1; i < size; ++i) slope[i - 1] = static_cast<double>(i) * c[i];
    const size_t found = roots_between(slope, low, high, turns);
    for (size_t i = 0; i < found; ++i) ends[count++] = turns[i];
  }
  ends[count++] = high;
  size_t found = 0;
  for (size_t i = 0; i + 1 < count; ++i) {
    double a = ends[i], b = ends[i + 1];
    const bool rises = value(b) > 0;
    if ((value(a) > 0) == rises) continue;
    constexpr int kHalvings = 60;  // to the last digit of lengths near 1
    for (int halving = 0; halving < kHalvings; ++halving) {
      const double middle = a + (b - a) / 2;
      ((value(middle) > 0) == rises ? b : a) = middle;
    }
    roots[found++] = b;
  }
  return found;
}

// A line in the frame of the axis, of unit direction and from where it is nearest to the origin, so
// that little is lost to rounding.
struct Line {
  Vec3 origin, direction;

  Vec3 at(double t) const { return origin + t * direction; }
  Vec2 turned(double t) const {
    const Vec3 p = at(t);
    return {std::hypot(p.x(), p.z()), p.y()};
  }
};

// Calls take(t) for the roots of a t^2 + 2 b t + c.
template <class Take>
void solve_square(double a, double b, double c, const Take& take) {
  const double root = b * b - a * c;
  if (root < 0) return;
  const double q = -(b + std::copysign(std::sqrt(root), b));
  if (a != 0) take(q / a);
  if (q != 0) take(c / q);
}

template <class Take>
void cross_segment(const Line& line, const Vec2& from, const Vec2& to, const Take& take) {
  const auto& [o, d] = line;
  const Vec2 along = to - from;
  if (along.y() == 0) {
    if (d.y() == 0) return;
    const double t = (from.y() - o.y()) / d.y();
    const double radius = line.turned(t).x();
    if (radius >= std::min(from.x(), to.x()) && radius <= std::max(from.x(), to.x())) take(t);
    return;
  }
  // Radius on the cone at the heights of the line: e + slope t.
  const double widening = along.x() / along.y(), slope = widening * d.y();
  const double e = from.x() + widening * (o.y() - from.y());
  const double low = std::min(from.y(), to.y()), high = std::max(from.y(), to.y());
  solve_square(square(d.x()) + square(d.z()) - slope * slope,
               o.x() * d.x() + o.z() * d.z() - e * slope, square(o.x()) + square(o.z()) - e * e,
               [&](double t) {
                 const double y = o.y() + t * d.y();
                 if (y >= low && y <= high) take(t);
               });
}

template <class Take>
void cross_arc(const Line& line, const Vec2& from, const Vec2& to, double bulge, const Take& take) {
  const auto& [o, d] = line;
  const ArcCircle circle = circle_of(from, to, bulge);
  const auto take_if_on_arc = [&](double t) {
    if (side_of(to - from, from, line.turned(t)) <= 0) take(t);
  };
  const Vec3 from_centre = o - Vec3(0, circle.centre.y(), 0);
  const double b = from_centre.dot(d), c = from_centre.squaredNorm();
  const double ring = circle.centre.x(), tube = circle.radius;
  // A ball, but for rounding.
  if (std::abs(ring) < 1e-12 * tube) {
    solve_square(1, b, c - tube * tube, take_if_on_arc);
    return;
  }
  const double reach = square(std::abs(ring) + tube) - (c - b * b);
  if (reach <= 0) return;
  // (p^2 + ring^2 - tube^2)^2 = 4 ring^2 (x^2 + z^2), from the middle of the chord on and in
  // lengths of the whole.
  const double length = std::abs(ring) + tube, middle = -b;
  const Vec3 p = (from_centre + middle * d) / length;
  const double r2 = square(ring / length);
  const double k = p.squaredNorm() + r2 - square(tube / length);
  const double dxz = square(d.x()) + square(d.z()), pdxz = p.x() * d.x() + p.z() * d.z();
  const double pxz = square(p.x()) + square(p.z());
  const std::array<double, 5> polynomial = {k * k - 4 * r2 * pxz, -8 * r2 * pdxz,
                                            2 * k - 4 * r2 * dxz, 0, 1};
  const double half = std::sqrt(reach) / length;
  std::array<double, 5> roots;
  const size_t count = roots_between(polynomial, -half, half, roots);
  for (size_t i = 0; i < count; ++i) take_if_on_arc(middle + length * roots[i]);
}

// Calls take(from, to, bulge) for each edge that sweeps a surface.
template <class Take>
void each_edge(const RoundOutline& outline, const Take& take) {
  for (size_t i = 0; i < outline.size(); ++i) {
    const OutlinePoint& from = outline[i];
    const OutlinePoint& to = outline[(i + 1) % outline.size()];
    if (from.bulge == 0 && from.radius == 0 && to.radius == 0) continue;
    take(Vec2(from.radius, from.y), Vec2(to.radius, to.y), from.bulge);
  }
}

}  // namespace

RoundOutline ball_outline(double radius) { return {{0, -radius, 1}, {0, radius, 0}}; }

RoundOutline frustum_outline(double radius, double top_radius, double height) {
  const double y = height / 2;
  if (top_radius == 0) return {{0, -y}, {radius, -y}, {0, y}};
  return {{0, -y}, {radius, -y}, {top_radius, y}, {0, y}};
}

RoundOutline capsule_outline(double radius, double height) {
  const double bulge = std::tan(kPi / 8), y = height / 2, middle = y - radius;
  return {{0, -y, bulge}, {radius, -middle}, {radius, middle, bulge}, {0, y}};
}

RoundOutline torus_outline(double ring, double tube) { return {{ring, -tube, 1}, {ring, tube, 1}}; }

RoundOutline tube_outline(double outer, double inner, double height) {
  const double y = height / 2;
  return {{inner, -y}, {outer, -y}, {outer, y}, {inner, y}};
}

Crossings crossings(const RoundSurface& surface, const Vec3& origin, const Vec3& direction) {
  const Quat back = surface.pose.orientation.conjugate();
  const double length = direction.norm();
  Line line{back * (origin - surface.pose.position), back * (direction / length)};
  const double nearest = -line.origin.dot(line.direction);
  line.origin = line.at(nearest);
  Crossings found;
  const auto take = [&](double t) { found.distance[found.count++] = (nearest + t) / length; };
  each_edge(surface.outline, [&](const Vec2& from, const Vec2& to, double bulge) {
    if (bulge == 0) {
      cross_segment(line, from, to, take);
    } else {
      cross_arc(line, from, to, bulge, take);
    }
  });
  return found;
}

Vec3 outward_normal(const RoundSurface& surface, const Vec3& point) {
  const Vec3 own = surface.pose.orientation.conjugate() * (point - surface.pose.position);
  const Vec2 place(std::hypot(own.x(), own.z()), own.y());
  double nearest = std::numeric_limits<double>::infinity();
  Vec2 normal = Vec2::UnitY();
  each_edge(surface.outline, [&](const Vec2& from, const Vec2& to, double bulge) {
    const Vec2 along = to - from;
    Vec2 outward(along.y(), -along.x());
    const double share = std::clamp((place - from).dot(along) / along.squaredNorm(), 0.0, 1.0);
    double distance = (place - from - share * along).norm();
    if (bulge != 0 && side_of(along, from, place) <= 0) {
      const ArcCircle circle = circle_of(from, to, bulge);
      outward = place - circle.centre;
      distance = std::abs(outward.norm() - circle.radius);
    }
    if (distance >= nearest) return;
    nearest = distance;
    normal = outward.normalized();
  });
  const Vec3 across =
      place.x() > 0 ? Vec3(own.x() / place.x(), 0, own.z() / place.x()) : Vec3(Vec3::UnitX());
  return surface.pose.orientation * Vec3(normal.x() * across + normal.y() * Vec3::UnitY());
}

Bounds bounds_of(const RoundSurface& surface) {
  Eigen::AlignedBox2d section;
  each_edge(surface.outline, [&](const Vec2& from, const Vec2& to, double bulge) {
    section.extend(from).extend(to);
    if (bulge == 0) return;
    const ArcCircle circle = circle_of(from, to, bulge);
    for (const Vec2& way : {Vec2(1, 0), Vec2(0, 1), Vec2(0, -1)}) {
      const Vec2 extreme = circle.centre + circle.radius * way;
      if (side_of(to - from, from, extreme) <= 0) section.extend(extreme);
    }
  });
  const Vec3 axis = surface.pose.orientation * Vec3::UnitY();
  const Vec3 aside = (1 - axis.array().square()).max(0).sqrt();
  const Vec3 reach = section.sizes().y() / 2 * axis.cwiseAbs() + section.max().x() * aside;
  const Vec3 centre = surface.pose.apply({0, section.center().y(), 0});
  return {centre - reach, centre + reach};
}

}  // namespace pilesim
