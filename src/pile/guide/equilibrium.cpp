#include "pile/guide/equilibrium.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace pilesim {
namespace {

// Powers below this share of the motion's size are rounding errors.
constexpr double kNoPower = 1e-11;

// An edge whose component orthogonal to the others is below this share adds only rounding.
constexpr double kParallel = 1e-11;

// A column that keeps less than this share is orthogonalised again. Must be below 1 to terminate:
// with 0.7 a column counts as parallel (kParallel) after 71 repetitions.
constexpr double kCancelled = 0.7;

// Cones take slightly more iterations than they have contacts.
constexpr int kMostSweeps = 200;

constexpr size_t kLanes = 4;

}  // namespace

void EquilibriumSolver::set_body(const Vec3& centre, double radius_m,
                                 std::span<const SupportPoint> contacts) {
  assert(radius_m > 0);
  count_ = static_cast<uint32_t>(contacts.size());
  const size_t padded = (count_ + kLanes - 1) / kLanes * kLanes;
  for (size_t axis = 0; axis < 3; ++axis) {
    normal_[axis].assign(padded, 0);
    arm_[axis].assign(padded, 0);
  }
  given_friction_.assign(padded, 0);
  power_.resize(padded);
  const double scale = 1 / radius_m;
  for (uint32_t i = 0; i < count_; ++i) {
    const SupportPoint& contact = contacts[i];
    const Vec3 arm = (contact.position - centre) * scale;
    for (int axis = 0; axis < 3; ++axis) {
      normal_[axis][i] = contact.normal[axis];
      arm_[axis][i] = arm[axis];
    }
    given_friction_[i] = contact.friction;
  }
  friction_ = given_friction_;
}

void EquilibriumSolver::scale_friction(double factor) {
  for (uint32_t i = 0; i < count_; ++i) friction_[i] = factor * given_friction_[i];
}

// Written for automatic vectorisation: no branches, no calls.
void EquilibriumSolver::power_of_cones(const Wrench& left) {
  const double* nx = normal_[0].data();
  const double* ny = normal_[1].data();
  const double* nz = normal_[2].data();
  const double* rx = arm_[0].data();
  const double* ry = arm_[1].data();
  const double* rz = arm_[2].data();
  const double* mu = friction_.data();
  double* power = power_.data();
  const double fx = left[0], fy = left[1], fz = left[2];
  const double tx = left[3], ty = left[4], tz = left[5];
  const size_t padded = power_.size();
  for (size_t i = 0; i < padded; ++i) {
    const double x = fx + ty * rz[i] - tz * ry[i];
    const double y = fy + tz * rx[i] - tx * rz[i];
    const double z = fz + tx * ry[i] - ty * rx[i];
    const double along = x * nx[i] + y * ny[i] + z * nz[i];
    const double across_squared = x * x + y * y + z * z - along * along;
    power[i] = along + mu[i] * std::sqrt(across_squared > 0 ? across_squared : 0);
  }
}

Vec3 EquilibriumSolver::edge_force(uint32_t i, const Vec3& motion) const {
  const Vec3 normal(normal_[0][i], normal_[1][i], normal_[2][i]);
  const Vec3 across = motion - motion.dot(normal) * normal;
  const double size = across.norm();
  return size > 0 ? Vec3(normal + friction_[i] / size * across) : normal;
}

EquilibriumSolver::Edge EquilibriumSolver::steepest_edge(const Wrench& left) {
  power_of_cones(left);
  Edge edge;
  for (uint32_t i = 0; i < count_; ++i) {
    if (i == 0 || power_[i] > edge.power) {
      edge.power = power_[i];
      edge.contact = i;
    }
  }
  const uint32_t i = edge.contact;
  const Vec3 arm(arm_[0][i], arm_[1][i], arm_[2][i]);
  edge.force = edge_force(i, left.head<3>() + left.tail<3>().cross(arm));
  return edge;
}

EquilibriumSolver::Wrench EquilibriumSolver::wrench_of(const Edge& edge) const {
  const uint32_t i = edge.contact;
  const Vec3 arm(arm_[0][i], arm_[1][i], arm_[2][i]);
  Wrench wrench;
  wrench << edge.force, arm.cross(edge.force);
  return wrench;
}

// Gram-Schmidt, repeated where most of the column cancels, since edges of an exact cone become
// nearly parallel. Gives false if nothing of the column is orthogonal to the earlier ones.
bool EquilibriumSolver::factor_column(int k) {
  Wrench v = active_.column[k];
  const double size = v.norm();
  for (int j = 0; j < k; ++j) active_.r[j][k] = 0;
  double rest = size;
  for (double before = 2 * rest; rest < kCancelled * before && rest > kParallel * size;) {
    for (int j = 0; j < k; ++j) {
      const double part = active_.q[j].dot(v);
      v -= part * active_.q[j];
      active_.r[j][k] += part;
    }
    before = rest;
    rest = v.norm();
  }
  active_.r[k][k] = rest;
  active_.q[k] = v / rest;
  return rest > kParallel * size;
}

// Brings the last column of the active set into the solution: the least squares solution over all
// of them, or, if it has negative weights, the farthest point towards it without any. Columns whose
// weight becomes zero are removed.
void EquilibriumSolver::take_in(const Wrench& wanted, Wrench& left) {
  ActiveSet& set = active_;
  std::array<double, 6> best;
  for (;;) {
    for (int k = set.count; k-- > 0;) {
      double value = set.projection[k];
      for (int j = k + 1; j < set.count; ++j) value -= set.r[k][j] * best[j];
      best[k] = value / set.r[k][k];
    }
    int blocking = -1;
    double share = 1;
    for (int k = 0; k < set.count; ++k) {
      if (best[k] > 0) continue;
      const double reached = set.weight[k] / (set.weight[k] - best[k]);
      if (blocking < 0 || reached < share) {
        share = reached;
        blocking = k;
      }
    }
    if (blocking < 0) break;
    int kept = 0;
    int first_gone = set.count;
    for (int k = 0; k < set.count; ++k) {
      const double weight = set.weight[k] + share * (best[k] - set.weight[k]);
      if (k == blocking || weight <= 0) {
        first_gone = std::min(first_gone, k);
        continue;
      }
      set.weight[kept] = weight;
      set.column[kept] = set.column[k];
      set.edge[kept] = set.edge[k];
      ++kept;
    }
    set.count = kept;
    left = wanted;
    for (int k = 0; k < kept; ++k) {
      if (k >= first_gone) {
        factor_column(k);
        set.projection[k] = set.q[k].dot(left);
      }
      left -= set.projection[k] * set.q[k];
    }
  }
  std::copy_n(best.begin(), set.count, set.weight.begin());
}

void EquilibriumSolver::gather_forces() {
  forces_.clear();
  for (int k = 0; k < active_.count; ++k) {
    const Edge& edge = active_.edge[k];
    const Vec3 force = active_.weight[k] * edge.force;
    const auto same = std::ranges::find(forces_, edge.contact, &ContactForce::contact);
    if (same == forces_.end()) {
      forces_.push_back({edge.contact, force});
    } else {
      same->force += force;
    }
  }
}

EquilibriumVerdict EquilibriumSolver::solve(const Vec3& up) {
  Wrench wanted;
  wanted << up, Vec3::Zero();
  Wrench left = wanted;
  ActiveSet& set = active_;
  set.count = 0;
  EquilibriumVerdict verdict;
  for (;; ++verdict.sweeps) {
    verdict.unbalanced = left.norm();
    verdict.stable = verdict.unbalanced <= tolerance_;
    if (verdict.stable || count_ == 0) break;
    const Edge edge = steepest_edge(left);
    verdict.resistance = std::max(0.0, edge.power / verdict.unbalanced);
    if (verdict.resistance <= kNoPower || verdict.sweeps == kMostSweeps || set.count == 6) break;
    const int k = set.count;
    set.edge[k] = edge;
    set.column[k] = wrench_of(edge);
    if (!factor_column(k)) break;
    set.weight[k] = 0;
    set.projection[k] = set.q[k].dot(left);
    if (set.projection[k] <= 0) break;
    left -= set.projection[k] * set.q[k];
    ++set.count;
    take_in(wanted, left);
  }
  gather_forces();
  verdict.push = -left.head<3>();
  verdict.turn = -left.tail<3>();
  return verdict;
}

double contact_spread(std::span<const SupportPoint> contacts, double radius_m) {
  if (contacts.empty()) return 0;
  const auto farthest_from = [&](const Vec3& point) {
    return std::ranges::max_element(contacts, {},
                                    [&](const SupportPoint& contact) {
                                      return (contact.position - point).squaredNorm();
                                    })
        ->position;
  };
  const Vec3 a = farthest_from(contacts.front().position);
  const Vec3 b = farthest_from(a);
  double area = 0;
  for (const SupportPoint& contact : contacts) {
    area = std::max(area, (contact.position - a).cross(b - a).norm());
  }
  return area / (radius_m * radius_m);
}

}  // namespace pilesim
