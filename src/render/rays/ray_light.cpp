#include "render/rays/ray_light.h"

#include <algorithm>
#include <cmath>

namespace pilesim {
namespace {

constexpr float kTurn = 2 * static_cast<float>(kPi);

float squared(float x) { return x * x; }

// Smith's masking of one direction.
float masking(float alpha, float cosine) {
  const float c2 = squared(std::max(cosine, 1e-4f));
  return 2 / (1 + std::sqrt(1 + squared(alpha) * (1 - c2) / c2));
}

Vec3f in_basis(const Basis& basis, const Vec3f& axis, const Vec3f& v) {
  return v.x() * basis.across + v.y() * basis.along + v.z() * axis;
}

}  // namespace

Vec3f background(const Lighting& light, const Vec3f& direction) {
  if (light.map) return light.map->shown(direction);
  const float share = 1 - std::exp(-2.2f * std::max(direction.y(), 0.0f));
  return light.horizon + share * (light.zenith - light.horizon);
}

// Without a branch for an axis (Duff et al. 2017).
Basis::Basis(const Vec3f& axis) {
  const float sign = std::copysign(1.0f, axis.z());
  const float a = -1 / (sign + axis.z());
  const float b = axis.x() * axis.y() * a;
  across = {1 + sign * squared(axis.x()) * a, sign * b, -sign * axis.x()};
  along = {b, sign + squared(axis.y()) * a, -axis.y()};
}

Vec3f sun_sample(const Vec3f& to_sun, const Basis& basis, float cosine,
                 const Eigen::Vector2f& point) {
  const float z = 1 - point.x() * (1 - cosine);
  const float r = std::sqrt(std::max(0.0f, 1 - z * z));
  const float turn = kTurn * point.y();
  return in_basis(basis, to_sun, {r * std::cos(turn), r * std::sin(turn), z});
}

Vec3f cosine_sample(const Vec3f& normal, const Eigen::Vector2f& point) {
  const float r = std::sqrt(point.x());
  const float turn = kTurn * point.y();
  return in_basis(Basis(normal), normal,
                  {r * std::cos(turn), r * std::sin(turn), std::sqrt(1 - point.x())})
      .normalized();
}

float reflectance(float cosine, bool leaves) {
  const float index = leaves ? 1 / kRefractiveIndex : kRefractiveIndex;
  const float within = 1 - (1 - squared(cosine)) / squared(index);
  if (within <= 0) return 1;
  const float beyond = std::sqrt(within);
  const float across = (cosine - index * beyond) / (cosine + index * beyond);
  const float along = (index * cosine - beyond) / (index * cosine + beyond);
  return 0.5f * (squared(across) + squared(along));
}

float Gloss::share(float cosine) const {
  const float edge = 1 - std::clamp(cosine, 0.0f, 1.0f);
  return strength * (facing + (1 - facing) * squared(squared(edge)) * edge);
}

float Gloss::reflected(const Vec3f& normal, const Vec3f& view, const Vec3f& light) const {
  const float to_light = normal.dot(light);
  const float to_view = std::max(normal.dot(view), 1e-4f);
  if (to_light <= 0 || strength <= 0) return 0;
  const Vec3f middle = (view + light).normalized();
  const float d = squared(normal.dot(middle)) * (squared(alpha) - 1) + 1;
  const float facets = squared(alpha / d);  // their density times pi
  return share(view.dot(middle)) * facets * masking(alpha, to_light) * masking(alpha, to_view) /
         (4 * to_light * to_view);
}

Vec3f Gloss::facet(const Vec3f& normal, const Vec3f& view, const Eigen::Vector2f& point) const {
  const Basis basis(normal);
  const Vec3f v =
      Vec3f(alpha * view.dot(basis.across), alpha * view.dot(basis.along), view.dot(normal))
          .normalized();
  const Basis around(v);
  const float r = std::sqrt(point.x());
  const float turn = kTurn * point.y();
  const float a = r * std::cos(turn);
  // The disc's rear half is scaled to the part that the hemisphere shows.
  const Vec3f up = (Vec3f(0, 0, 1) - v.z() * v);
  const Vec3f second = up.squaredNorm() > 1e-8f ? Vec3f(up.normalized()) : around.along;
  const Vec3f first = second.cross(v);
  const float s = 0.5f * (1 + v.z());
  const float b = (1 - s) * std::sqrt(std::max(0.0f, 1 - a * a)) + s * r * std::sin(turn);
  const float c = std::sqrt(std::max(0.0f, 1 - a * a - b * b));
  const Vec3f m = a * first + b * second + c * v;
  return in_basis(basis, normal, {alpha * m.x(), alpha * m.y(), std::max(m.z(), 1e-6f)})
      .normalized();
}

float Gloss::weight(const Vec3f& normal, const Vec3f& view, const Vec3f& light) const {
  const float to_light = normal.dot(light);
  if (to_light <= 0) return 0;
  const Vec3f middle = (view + light).normalized();
  const float once = share(view.dot(middle));
  const float open = masking(alpha, to_light);
  // Other facets are in the way of the rest, which those of a metal mirror once more.
  return once * (open + metallic * (1 - open) * once);
}

float Gloss::density(const Vec3f& normal, const Vec3f& view, const Vec3f& light) const {
  const float to_view = std::max(normal.dot(view), 1e-4f);
  const Vec3f middle = (view + light).normalized();
  const float d = squared(normal.dot(middle)) * (squared(alpha) - 1) + 1;
  return masking(alpha, to_view) * squared(alpha / d) / (4 * static_cast<float>(kPi) * to_view);
}

}  // namespace pilesim
