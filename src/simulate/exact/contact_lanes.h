// Operations on the lanes of a block that all parts of the contact solver use.
#pragma once

#include <algorithm>

#include "core/parallel_for.h"
#include "simulate/exact/contact_solver.h"

namespace pilesim::exact {

// By visit(batch, block), each stage after the one before.
template <typename Visit>
void ContactSolver::for_blocks(const Visit& visit) {
  for (size_t k = 0; k + 1 < stage_first_.size(); ++k) {
    const uint32_t first = stage_first_[k], count = stage_first_[k + 1] - first;
    parallel_for(count, is_small_ ? std::max(count, 1U) : 1, [&](size_t begin, size_t end) {
      for (size_t n = first + begin; n < first + end; ++n) {
        for (uint32_t m = batches_[n].first; m < batches_[n].end; ++m) visit(n, blocks_[m]);
      }
    });
  }
}

struct ContactSolver::Gathered {
  Lanes3<T> velocity_a, spin_a, velocity_b, spin_b;
};

HWY_INLINE typename ContactSolver::Gathered ContactSolver::gather(
    const Block& block, std::span<const Motion> motions) const {
  Gathered g;
  std::array<const T*, kLanes> rows;
  std::array<Lanes<T>, 8> r;
  for (size_t i = 0; i < kLanes; ++i) rows[i] = motions[block.a[i]].v.data();
  gather8(rows.data(), r);
  g.velocity_a = {r[0], r[1], r[2]};
  g.spin_a = {r[3], r[4], r[5]};
  for (size_t i = 0; i < kLanes; ++i) rows[i] = motions[block.b[i]].v.data();
  gather8(rows.data(), r);
  g.velocity_b = {r[0], r[1], r[2]};
  g.spin_b = {r[3], r[4], r[5]};
  return g;
}

// As they lie in Shift.
struct ContactSolver::GatheredShifts {
  std::array<Lanes<T>, 8> a, b;
};

HWY_INLINE typename ContactSolver::GatheredShifts ContactSolver::gather_shifts(
    const Block& block) const {
  GatheredShifts shifts;
  std::array<const T*, kLanes> rows;
  for (size_t i = 0; i < kLanes; ++i) rows[i] = shifts_[block.a[i]].v.data();
  gather8(rows.data(), shifts.a);
  for (size_t i = 0; i < kLanes; ++i) rows[i] = shifts_[block.b[i]].v.data();
  gather8(rows.data(), shifts.b);
  return shifts;
}

HWY_INLINE void ContactSolver::scatter(const Block& block, const Gathered& g,
                                       std::span<Motion> motions) const {
  std::array<T*, kLanes> rows;
  const auto place = [&](uint32_t body) {
    return body < moving_ ? motions[body].v.data() : nullptr;
  };
  const Lanes<T> zero(T{0});
  std::array<Lanes<T>, 8> r = {g.velocity_a.x, g.velocity_a.y, g.velocity_a.z, g.spin_a.x,
                               g.spin_a.y,     g.spin_a.z,     zero,           zero};
  for (size_t i = 0; i < kLanes; ++i) rows[i] = place(block.a[i]);
  scatter8(r, rows.data());
  r = {g.velocity_b.x, g.velocity_b.y, g.velocity_b.z, g.spin_b.x,
       g.spin_b.y,     g.spin_b.z,     zero,           zero};
  for (size_t i = 0; i < kLanes; ++i) rows[i] = place(block.b[i]);
  scatter8(r, rows.data());
}

template <typename T, typename Block>
struct Weights {
  explicit HWY_INLINE Weights(const Block& block)
      : mass_a(Lanes<T>::load(block.inverse_mass_a.data())),
        mass_b(Lanes<T>::load(block.inverse_mass_b.data())),
        inertia_a(load_sym<T>(block.inertia_a)),
        inertia_b(load_sym<T>(block.inertia_b)) {}

  template <typename G>
  HWY_INLINE void apply(const Lanes3<T>& push, const Lanes3<T>& arm_a, const Lanes3<T>& arm_b,
                        G& g) const {
    g.velocity_a = sub_scaled(g.velocity_a, mass_a, push);
    g.spin_a = g.spin_a - inertia_a * cross(arm_a, push);
    g.velocity_b = add_scaled(g.velocity_b, mass_b, push);
    g.spin_b = g.spin_b + inertia_b * cross(arm_b, push);
  }

  Lanes<T> mass_a, mass_b;
  Sym<T> inertia_a, inertia_b;
};

template <typename T, typename G>
HWY_INLINE Lanes3<T> relative(const G& g, const Lanes3<T>& arm_a, const Lanes3<T>& arm_b) {
  return (g.velocity_b + cross(g.spin_b, arm_b)) - (g.velocity_a + cross(g.spin_a, arm_a));
}

// Friction that stops what goes by `dv` across `n`, as far as `limit` goes.
template <typename T>
HWY_INLINE Lanes3<T> hold_back(const Lanes3<T>& dv, const Lanes3<T>& n, Lanes<T> mass,
                               Lanes<T> limit, const Lanes3<T>& before) {
  const Lanes3<T> sliding = sub_scaled(dv, dot(n, dv), n);
  const Lanes3<T> held = sub_scaled(before, mass, sliding);
  const Lanes<T> one(T{1}), size2 = dot(held, held);
  const auto slips = size2 > limit * limit;
  return select(slips, limit / sqrt(select(slips, size2, one)), one) * held;
}

// How b falls against a in the step, m.
HWY_INLINE Lanes3<float> ContactSolver::fall_between(const Weights<T, Block>& weights) const {
  const Lanes<T> zero(T{0}), one(T{1});
  const Lanes<T> falls =
      select(weights.mass_b > zero, one, zero) - select(weights.mass_a > zero, one, zero);
  return falls * Lanes3<T>{Lanes<T>(fall_.x()), Lanes<T>(fall_.y()), Lanes<T>(fall_.z())};
}

// m/s, at most 0: so fast a point may come nearer that it is reached when the step ends.
HWY_INLINE Lanes<float> ContactSolver::approach(const PointStart& start, const Lanes3<T>& normal,
                                                const Lanes3<T>& fall) const {
  const Lanes<T> gap = Lanes<T>::load(start.distance.data()) + dot(normal, fall);
  const Lanes<T> zero(T{0});
  return zero - Lanes<T>(per_step_) * max(gap, zero);
}

}  // namespace pilesim::exact
