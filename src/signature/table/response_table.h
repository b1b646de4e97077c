// The response of a body to a collision: tables of the mean and spread of the velocities after it,
// over the keys of the collision.
//
// Working frame of a collision with a plane of normal n: y = n, x along the part of the velocity
// that is parallel to the plane, z = x cross y. In it the velocity is |v| (sin theta, -cos theta,
// 0), and the spin has the angle phi to the velocity; psi is its azimuth about the velocity, from z
// cross v towards z.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "core/types.h"
#include "signature/table/axis.h"

namespace pilesim {

enum class TableLayout {
  // Keys theta, phi, |v|, |w|; psi is averaged over. Responses are v+ minus the v+ of a particle
  // (m/s) and w+ (rad/s), with independent components (dissertation 3.2.3.2).
  dissertation,
  // Keys theta, phi, psi, alpha = atan(k |w| / |v|). Responses are v+ and k w+ in units of sqrt(v^2
  // + k^2 w^2), with their full covariance. Valid only where restitution does not depend on speed.
  scale_free,
};
std::string layout_name(TableLayout layout);

using Vector6 = Eigen::Matrix<float, 6, 1>;  // v+ (3), w+ (3), working frame, units of the layout
inline constexpr size_t kFactorSize = 21;    // of a lower triangular 6 x 6 matrix, row by row
constexpr size_t lower_index(size_t row, size_t column) { return row * (row + 1) / 2 + column; }

// One row per cell; cells in row-major order of the axes (the last one runs fastest).
struct ResponseTable {
  TableLayout layout = TableLayout::scale_free;
  std::array<Axis, 4> axes;
  std::vector<float> trials;  // (cells) effective number: a trial counts for the cells around it
  std::vector<float> mean;    // (cells, 6)
  // Dissertation's layout: standard deviations (cells, 6). Scale-free: lower Cholesky factor of the
  // covariance (cells, 21).
  std::vector<float> spread;
  std::vector<float> mean_error;  // (cells, 6), standard error of `mean`
  // Largest growth of sqrt(v^2 + k^2 w^2), at least 1. It can grow because k stands for all axes: a
  // thin body that rolls off spins fast with little energy. Samples are limited to it.
  float most_growth = 1;
  // Optional: responses near the cell minus its mean, in exemplar_unit (cells, exemplar_count, 6).
  // Many rounded exemplars serve better than few exact ones.
  uint32_t exemplar_count = 0;
  float exemplar_unit = 1;
  std::vector<int8_t> exemplars;

  size_t cell_count() const {
    return axes[0].size() * axes[1].size() * axes[2].size() * axes[3].size();
  }
  size_t cell(const std::array<uint32_t, 4>& index) const {
    return ((index[0] * axes[1].size() + index[1]) * axes[2].size() + index[2]) * axes[3].size() +
           index[3];
  }
  std::array<uint32_t, 4> cell_index(size_t cell) const;
  size_t spread_size() const { return layout == TableLayout::dissertation ? 6 : kFactorSize; }
};

// A table without values, with the axes of its layout. `gyration_m` scales the dissertation's |w|
// axis.
ResponseTable make_table(TableLayout layout, double gyration_m);

// The velocity and spin, working frame, at the keys of a cell (in the scale-free layout: with
// v^2 + k^2 w^2 = 1). psi = 0 in the dissertation's layout.
struct CellConfiguration {
  Vec3 velocity, spin;
};
CellConfiguration cell_configuration(const ResponseTable& table, size_t cell, double gyration_m);

// The spin at angle phi to the velocity and azimuth psi about it.
Vec3 spin_direction(double theta, double phi, double psi);

// The keys of a collision: velocity and spin in its working frame (velocity.z = 0). psi is 0 where
// the spin is parallel to the velocity.
inline std::array<float, 4> response_keys(const ResponseTable& table, float gyration_m,
                                          const Vec3f& v, const Vec3f& w) {
  const float speed = v.norm(), spin = w.norm();
  const float theta = std::atan2(std::hypot(v.x(), v.z()), -v.y());
  const float cosine = speed * spin > 0 ? v.dot(w) / (speed * spin) : 1.0F;
  const float phi = std::acos(std::clamp(cosine, -1.0F, 1.0F));
  if (table.layout == TableLayout::dissertation) return {theta, phi, speed, spin};
  // Components along z cross v, and along z.
  const float side = w.x() * -v.y() + w.y() * v.x();
  const float psi = std::atan2(w.z() * speed, side);
  return {theta, phi, psi, std::atan2(gyration_m * spin, speed)};
}

// The velocity after the collision of a particle without extent: Newton's restitution and Coulomb's
// friction. Working frame.
Vec3 particle_response(const Vec3& velocity, double restitution, double friction);

}  // namespace pilesim
