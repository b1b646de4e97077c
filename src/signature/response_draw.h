// Samples a random response of a colliding body from its response table or fit. The statistical
// simulator does this at every contact instead of solving it.
#pragma once

#include <cmath>

#include "core/philox.h"
#include "core/types.h"
#include "signature/response_model.h"

namespace pilesim {

// How much of the table is used.
enum class DrawModel {
  particle,  // no table: a particle's bounce, the spin kept
  diagonal,  // normal distributions, component by component (all that the dissertation's table has)
  full,      // a normal distribution with the full covariance
  // Residual of a stored response near a surrounding cell, added to the interpolated mean.
  exemplars,
};
inline DrawModel best_model(const ResponseTable& table) {
  if (table.exemplar_count > 0) return DrawModel::exemplars;
  return table.layout == TableLayout::dissertation ? DrawModel::diagonal : DrawModel::full;
}

// The velocities of a collision in its working frame, see response_table.h.
struct WorkingFrame {
  Vec3f x, y, z;  // unit, world
  Vec3f to_frame(const Vec3f& v) const { return {x.dot(v), y.dot(v), z.dot(v)}; }
  Vec3f to_world(const Vec3f& v) const { return v.x() * x + v.y() * y + v.z() * z; }
};
// `normal` is unit and points towards the body. x is arbitrary where the velocity is along the
// normal.
inline WorkingFrame working_frame(const Vec3f& normal, const Vec3f& velocity) {
  Vec3f x = velocity - velocity.dot(normal) * normal;
  const float length = x.norm();
  // Below the rounding of the subtraction the direction is noise, and irrelevant.
  x = length > 1e-6F * velocity.norm() ? Vec3f(x / length) : normal.unitOrthogonal();
  return {x, normal, x.cross(normal)};
}

// The limits of a response, in units of the kinetic measure before, v^2 + k^2 w^2 = 1: the body
// leaves the plane, and the measure grows by at most `most_growth`. A response outside is moved to
// the nearest one inside.
struct DrawLimits {
  bool energy_gain = false;  // before the limits were applied
  bool inward = false;
};
inline DrawLimits limit_response(float most_growth, Vector6& response) {
  const DrawLimits limits{response.norm() > most_growth, response(1) < 0};
  response(1) = std::max(0.0F, response(1));
  const float size = response.norm();
  if (size > most_growth) response *= most_growth / size;
  return limits;
}

struct ResponseDraw {
  Vec3f velocity, spin;  // after the collision, in the frame of the velocities before
  DrawLimits limits;
};

// `velocity` approaches the plane of unit normal `normal`; world frame. The signature's material
// gives restitution and friction.
inline ResponseDraw draw_response(const ResponseModel& responses, DrawModel model, float gyration_m,
                                  double restitution, double friction, const Vec3f& normal,
                                  const Vec3f& velocity, const Vec3f& spin, Philox& random) {
  const ResponseTable& table = responses.table();
  const WorkingFrame frame = working_frame(normal, velocity);
  const Vec3f v = frame.to_frame(velocity), w = frame.to_frame(spin);
  const float measure = std::sqrt(v.squaredNorm() + gyration_m * gyration_m * w.squaredNorm());
  const bool raw = table.layout == TableLayout::dissertation;
  const Vec3f particle = particle_response(v.cast<double>(), restitution, friction).cast<float>();
  if (model == DrawModel::particle) {
    return {frame.to_world(particle), spin, {}};
  }
  const ResponseKeys keys = response_keys(table, gyration_m, v, w);
  Vector6 response;
  if (model == DrawModel::exemplars) {
    const ResponseSpread here = interpolate(table, keys);
    response = here.mean;
    float left = static_cast<float>(random.uniform());
    size_t corner = 0;
    while (corner < 15 && left >= here.weights[corner]) left -= here.weights[corner++];
    const size_t cell = here.cells[corner];
    const size_t exemplar = cell * table.exemplar_count + random.index(table.exemplar_count);
    for (Eigen::Index i = 0; i < 6; ++i) {
      const auto k = static_cast<size_t>(i);
      response(i) += table.exemplar_unit * table.exemplars[6 * exemplar + k];
    }
  } else {
    SpreadFactor factor;
    responses.evaluate(keys, response, factor);
    Vector6 normal_draw;
    for (Eigen::Index i = 0; i < 6; ++i) normal_draw(i) = static_cast<float>(random.normal());
    size_t at = 0;
    for (Eigen::Index i = 0; i < 6; ++i) {
      if (model == DrawModel::full) {
        for (Eigen::Index j = 0; j <= i; ++j) response(i) += factor[at++] * normal_draw(j);
      } else {
        float variance = 0;
        for (Eigen::Index j = 0; j <= i; ++j, ++at) variance += factor[at] * factor[at];
        response(i) += std::sqrt(variance) * normal_draw(i);
      }
    }
  }
  if (raw) {
    response.head<3>() = (response.head<3>() + particle) / measure;
    response.tail<3>() *= gyration_m / measure;
  }
  ResponseDraw draw;
  draw.limits = limit_response(table.most_growth, response);
  draw.velocity = frame.to_world(measure * response.head<3>());
  draw.spin = frame.to_world(measure / gyration_m * response.tail<3>());
  return draw;
}

}  // namespace pilesim
