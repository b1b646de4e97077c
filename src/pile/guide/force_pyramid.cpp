#include "pile/guide/force_pyramid.h"

#include <cmath>

namespace pilesim {
namespace {

using Eigen::Index;

constexpr Index kBalance = 6;  // rows of force in weights and of torque in m g r
constexpr Index kMissing = -1;

// Smaller values are rounding errors.
constexpr double kRounding = 1e-9;

}  // namespace

bool ForcePyramids::is_free(Index variable) const {
  return variable >= count_ && variable < 3 * count_;
}

// Phase one of the simplex method: its cost is the residual of the balance.
void ForcePyramids::set_up(const Vec3& centre, double radius_m,
                           std::span<const SupportPoint> contacts, const Vec3& up) {
  count_ = static_cast<Index>(contacts.size());
  const Index rows = kBalance + 4 * count_, variables = 7 * count_;
  tableau_.setZero(rows + 1, variables + 1);
  basis_.assign(static_cast<size_t>(rows), kMissing);
  sign_.assign(static_cast<size_t>(variables), 1);
  for (Index i = 0; i < count_; ++i) {
    const SupportPoint& contact = contacts[static_cast<size_t>(i)];
    const Vec3 arm = (contact.position - centre) / radius_m;
    const Vec3 tangent_1 = contact.normal.unitOrthogonal();
    const auto push = [&](Index variable, const Vec3& along) {
      tableau_.col(variable).head<kBalance>() << along, arm.cross(along);
    };
    push(i, contact.normal);
    push(count_ + 2 * i, tangent_1);
    push(count_ + 2 * i + 1, contact.normal.cross(tangent_1));
    for (Index side = 0; side < 4; ++side) {
      const Index row = kBalance + 4 * i + side, left = 3 * count_ + 4 * i + side;
      tableau_(row, i) = -contact.friction;
      tableau_(row, count_ + 2 * i + side / 2) = side % 2 == 0 ? 1 : -1;
      tableau_(row, left) = 1;
      basis_[static_cast<size_t>(row)] = left;
    }
  }
  tableau_.col(variables).head<3>() = up;
  for (Index row = 0; row < kBalance; ++row) {
    if (tableau_(row, variables) < 0) tableau_.row(row) *= -1;
  }
  tableau_.row(rows) = -tableau_.topRows<kBalance>().colwise().sum();
}

// The first variable that lowers the cost, or -1.
Index ForcePyramids::entering() {
  const Index cost = tableau_.rows() - 1;
  for (Index variable = 0; variable < tableau_.cols() - 1; ++variable) {
    if (is_free(variable) && tableau_(cost, variable) > kRounding) {
      tableau_.col(variable) *= -1;
      sign_[static_cast<size_t>(variable)] *= -1;
    }
    if (tableau_(cost, variable) < -kRounding) return variable;
  }
  return kMissing;
}

// The row that is exhausted first; among equals, that of the first variable. Free variables never
// leave.
Index ForcePyramids::leaving(Index entering) const {
  const Index right = tableau_.cols() - 1;
  Index best = kMissing;
  double least = 0;
  for (Index row = 0; row < tableau_.rows() - 1; ++row) {
    const Index variable = basis_[static_cast<size_t>(row)];
    if (tableau_(row, entering) <= kRounding || is_free(variable)) continue;
    const double ratio = tableau_(row, right) / tableau_(row, entering);
    const bool is_first =
        best == kMissing || ratio < least - kRounding ||
        (ratio <= least + kRounding && variable < basis_[static_cast<size_t>(best)]);
    if (!is_first) continue;
    best = row;
    least = ratio;
  }
  return best;
}

bool ForcePyramids::solve(const Vec3& centre, double radius_m,
                          std::span<const SupportPoint> contacts, const Vec3& up) {
  set_up(centre, radius_m, contacts, up);
  // Bland's rule terminates; the limit guards against cycles from rounding.
  for (Index left = 100 * (count_ + 1); left > 0; --left) {
    const Index variable = entering();
    if (variable == kMissing) break;
    const Index row = leaving(variable);
    if (row == kMissing) break;
    tableau_.row(row) /= tableau_(row, variable);
    Eigen::VectorXd factors = tableau_.col(variable);
    factors[row] = 0;
    tableau_.noalias() -= factors * Eigen::RowVectorXd(tableau_.row(row));
    basis_[static_cast<size_t>(row)] = variable;
  }
  forces_.assign(contacts.size(), {});
  const Index right = tableau_.cols() - 1;
  for (Index row = 0; row < tableau_.rows() - 1; ++row) {
    const Index variable = basis_[static_cast<size_t>(row)];
    if (variable == kMissing || variable >= 3 * count_) continue;
    const double value = sign_[static_cast<size_t>(variable)] * tableau_(row, right);
    if (!is_free(variable)) {
      forces_[static_cast<size_t>(variable)].normal = value;
      continue;
    }
    PyramidForce& force = forces_[static_cast<size_t>((variable - count_) / 2)];
    ((variable - count_) % 2 == 0 ? force.tangent_1 : force.tangent_2) = value;
  }
  return -tableau_(tableau_.rows() - 1, right) <= kForceTolerance;
}

}  // namespace pilesim
