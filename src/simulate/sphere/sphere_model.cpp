#include "simulate/sphere/sphere_model.h"

#include <Eigen/Eigenvalues>

#include <map>
#include <tuple>

#include "geometry/convex_hull.h"

namespace pilesim {
namespace {

using namespace sphere_constants;

void set_hull(std::span<const Vec3> vertices, SphereKind& kind) {
  const TriangleMesh hull = convex_hull(vertices);
  kind.hull.corners.resize(3, static_cast<Eigen::Index>(hull.vertices.size()));
  for (Eigen::Index i = 0; i < kind.hull.corners.cols(); ++i) {
    kind.hull.corners.col(i) = hull.vertices[static_cast<size_t>(i)].cast<float>().array();
  }
  kind.hull.faces.resize(3, static_cast<Eigen::Index>(hull.triangles.size()));
  for (Eigen::Index i = 0; i < kind.hull.faces.cols(); ++i) {
    const auto& triangle = hull.triangles[static_cast<size_t>(i)];
    const Vec3& a = hull.vertices[triangle[0]];
    const Vec3 normal = (hull.vertices[triangle[1]] - a).cross(hull.vertices[triangle[2]] - a);
    kind.hull.faces.col(i) = (normal / normal.dot(a)).cast<float>().array();
  }
}

// The ellipsoid with the same moments, as a stretched ball of radius 1, with bounded ratios.
void set_form(const Mat3& inertia_m5, SphereKind& kind) {
  const Mat3 moments = inertia_m5.trace() / 2 * Mat3::Identity() - inertia_m5;
  const Eigen::SelfAdjointEigenSolver<Mat3> axes(moments);
  Vec3 squares = axes.eigenvalues();
  squares = squares.cwiseMax(squares.maxCoeff() / (kMostStretch * kMostStretch));
  squares /= std::cbrt(squares.prod());
  kind.is_round = squares.maxCoeff() < kRound * squares.minCoeff();
  if (kind.is_round) return;
  const Mat3 form = axes.eigenvectors() * squares.asDiagonal() * axes.eigenvectors().transpose();
  kind.form = {form.cast<float>(), static_cast<float>(std::sqrt(squares.maxCoeff())),
               static_cast<float>(std::sqrt(squares.minCoeff()))};
}

// Highest speed at which a body cannot roll on over its long or wide sides.
float control_speed(const BodySignature& object, float gravity) {
  float lowest_m = object.outer_radius_m;
  for (const RestTarget& target : object.rest_targets) {
    lowest_m = std::min(lowest_m, target.height_m);
  }
  const float over = kOver * std::sqrt(2 * gravity * (object.outer_radius_m - lowest_m));
  return std::max(kControlSpeed * std::sqrt(gravity * object.outer_radius_m), over);
}

// Factor by which two touching ellipsoids may be farther apart than their longest semi-axes.
float how_unlike(const SphereKind& a, const SphereKind& b) {
  if (a.object == nullptr || b.object == nullptr) return 1;
  const float sum = a.radius_m + b.radius_m;
  const float balls = sum * sum / (a.radius_m * a.radius_m + b.radius_m * b.radius_m);
  const float long_a = a.form.longest * a.radius_m, long_b = b.form.longest * b.radius_m;
  return std::sqrt(balls * (long_a * long_a + long_b * long_b)) / (long_a + long_b);
}

SphereKind kind_of_body(const Model& model, const SphereWorldSettings& settings,
                        const ModelBody& body, const BodySignature* object) {
  SphereKind kind{.object = object, .mass_kg = static_cast<float>(body.mass_kg)};
  const Material& material = model.materials[body.material];
  kind.root_friction = static_cast<float>(std::sqrt(material.friction));
  kind.root_restitution = static_cast<float>(std::sqrt(material.restitution));
  if (object == nullptr) return kind;
  kind.root_friction *= object->interlocking;
  const float gravity = settings.gravity.norm();
  const float radius = object->packing_radius_m, k = object->gyration_m;
  const float time_s =
      gravity > 0 ? kPositionTime * std::sqrt(radius / gravity) : kPositionTimeInFlight;
  kind.radius_m = radius;
  kind.outer_m = object->outer_radius_m;
  kind.thin_m = radius;
  kind.rolling_m = object->rolling * radius;
  kind.control_speed = control_speed(*object, gravity);
  kind.lift = -std::expm1(-settings.step_s / (time_s * kPositionSweeps));
  kind.inverse_mass = 1 / kind.mass_kg;
  kind.inverse_inertia = kind.inverse_mass / (k * k);
  const ModelShape& shape = model.shapes[body.shape];
  if (object->signature) {
    set_hull(shape.mesh.vertices, kind);
    if (kind.hull.least_m() < kThin * radius) kind.thin_m = kind.hull.least_m();
    set_form(shape.mass.inertia_m5, kind);
  }
  if (settings.blocks) kind.block = block_shape(shape.mesh, shape.mass.volume_m3);
  return kind;
}

}  // namespace

SphereModel::SphereModel(const Model& of_model, const BodySignatures& objects,
                         const SphereWorldSettings& with_settings)
    : model(of_model), settings(with_settings) {
  const float gravity = settings.gravity.norm();
  if (gravity > 0) up = settings.gravity / -gravity;
  impact_base = kImpactFall * gravity * settings.step_s;
  impact_rise = kImpactSpeed * std::sqrt(gravity);
  std::map<std::tuple<uint32_t, uint32_t, double, bool>, uint32_t> known;
  for (const ModelBody& body : model.bodies) {
    const bool dynamic = body.role == Role::dynamic;
    has_structures |= body.asleep;
    const auto [kind, is_new] =
        known.try_emplace({body.shape, body.material, body.mass_kg, dynamic}, kinds.size());
    if (is_new) {
      kinds.push_back(kind_of_body(model, settings, body,
                                   dynamic ? &objects.at({body.shape, body.material}) : nullptr));
    }
    kind_of.push_back(kind->second);
    stretched.push_back(dynamic && !body.asleep && !kinds[kind->second].is_round ? 1 : 0);
  }
  for (const SphereKind& a : kinds) {
    for (const SphereKind& b : kinds) unlike = std::max(unlike, how_unlike(a, b));
  }
}

}  // namespace pilesim
