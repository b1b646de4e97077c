// The part of the contact solver that holds back rolling and spinning.
#include <array>
#include <cmath>

#include "core/parallel_for.h"
#include "simulate/exact/contact_solver.h"

namespace pilesim::exact {

namespace {

constexpr size_t kGrain = 16;

// Spins of the bodies of a block, with the rest of their rows.
template <typename T>
struct Spins {
  using L = Lanes<T>;

  template <typename Block, typename Motions>
  HWY_INLINE Spins(const Block& block, const Motions& motions) {
    std::array<const T*, L::kCount> rows;
    for (size_t i = 0; i < L::kCount; ++i) rows[i] = motions[block.a[i]].v.data();
    gather8(rows.data(), a);
    for (size_t i = 0; i < L::kCount; ++i) rows[i] = motions[block.b[i]].v.data();
    gather8(rows.data(), b);
  }

  HWY_INLINE Lanes3<T> relative() const { return {b[3] - a[3], b[4] - a[4], b[5] - a[5]}; }

  // By a torque on b times a time, N m s.
  HWY_INLINE void apply(const Sym<T>& inertia_a, const Sym<T>& inertia_b, const Lanes3<T>& torque) {
    const Lanes3<T> of_a = inertia_a * torque, of_b = inertia_b * torque;
    a[3] = a[3] - of_a.x;
    a[4] = a[4] - of_a.y;
    a[5] = a[5] - of_a.z;
    b[3] = b[3] + of_b.x;
    b[4] = b[4] + of_b.y;
    b[5] = b[5] + of_b.z;
  }

  template <typename Block, typename Motions>
  HWY_INLINE void scatter(const Block& block, Motions& motions, size_t moving) {
    std::array<T*, L::kCount> rows;
    const auto place = [&](uint32_t body) {
      return body < moving ? motions[body].v.data() : nullptr;
    };
    for (size_t i = 0; i < L::kCount; ++i) rows[i] = place(block.a[i]);
    scatter8(a, rows.data());
    for (size_t i = 0; i < L::kCount; ++i) rows[i] = place(block.b[i]);
    scatter8(b, rows.data());
  }

  std::array<L, 8> a, b;
};

// One over what is above 0, else 0.
template <typename T>
HWY_INLINE Lanes<T> inverse_or_zero(Lanes<T> value) {
  const Lanes<T> zero(T{0}), one(T{1});
  const auto there = value > zero;
  return select(there, one / select(there, value, one), zero);
}

// The determinant uu vv - uv^2; of long rods it is rounding, and a larger one only answers less.
template <typename T>
HWY_INLINE Lanes<T> area_of(Lanes<T> uu, Lanes<T> vv, Lanes<T> uv) {
  return max(neg_mul_add(uv, uv, uu * vv), Lanes<T>(T{1e-5F}) * uu * vv);
}

// The power of two that brings what is above 0 to [1, 2), else 1.
template <typename T>
HWY_INLINE Lanes<T> power_of_two_over(Lanes<T> value) {
  alignas(64) std::array<T, Lanes<T>::kCount> numbers;
  value.store(numbers.data());
  for (T& number : numbers) number = number > 0 ? std::ldexp(T{1}, -std::ilogb(number)) : T{1};
  return Lanes<T>::load(numbers.data());
}

template <typename T>
HWY_INLINE Lanes3<T> in_world(const Lanes3<T>& n, const Lanes3<T>& u, const Lanes3<T>& v,
                              const Lanes3<T>& parts) {
  return add_scaled(add_scaled(parts.x * n, parts.y, u), parts.z, v);
}

}  // namespace

// Once fill() has filled blocks and points.
void ContactSolver::fill_torques(std::span<const ContactRange> contacts, double substep_s) {
  using L = Lanes<T>;
  torques_.assign(points_.size(), {});
  parallel_for(blocks_.size(), kGrain, [&](size_t begin, size_t end) {
    for (size_t m = begin; m < end; ++m) {
      Block& block = blocks_[m];
      Row rolling{}, spinning{};
      for (size_t i = 0; i < kLanes; ++i) {
        const uint32_t source = order_[m * kLanes + i];
        if (source == kNone) continue;
        rolling[i] = static_cast<T>(contacts[source].arms.rolling_m);
        spinning[i] = static_cast<T>(contacts[source].arms.spinning_m);
        block.holds_turning = block.holds_turning || rolling[i] > 0 || spinning[i] > 0;
      }
      if (!block.holds_turning) continue;
      const Sym<T> inertia_a = load_sym<T>(block.inertia_a),
                   inertia_b = load_sym<T>(block.inertia_b);
      const L zero(T{0}), one(T{1}), half(T{0.5});
      for (uint32_t p = 0; p < block.points; ++p) {
        const Point& point = points_[block.first_point + p];
        Torque& torque = torques_[block.first_point + p];
        torque.spinning = spinning;
        torque.rolling = rolling;
        const Lanes3<T> n = load3<T>(point.normal);
        const auto flat = L::of(hn::Abs(n.x.v)) > L(static_cast<T>(0.6));
        const Lanes3<T> other = {select(flat, zero, one), select(flat, one, zero), zero};
        Lanes3<T> u = cross(n, other);
        const L length2 = dot(u, u);
        const auto real = length2 > zero;  // of a lane that is not empty
        u = (one / sqrt(select(real, length2, one))) * u;
        const Lanes3<T> v = cross(n, u);
        store3<T>(u, torque.across);
        const auto answer = [&](const Lanes3<T>& x, const Lanes3<T>& y) {
          return dot(x, inertia_a * y + inertia_b * y);
        };
        inverse_or_zero(answer(n, n)).store(torque.along_mass.data());
        // Near 1: squares of what heavy bodies answer are no floats.
        const L scale = power_of_two_over(answer(u, u) + answer(v, v));
        const L uu = scale * answer(u, u), vv = scale * answer(v, v), uv = scale * answer(u, v);
        const L per_area = scale * inverse_or_zero(area_of(uu, vv, uv));
        (vv * per_area).store(torque.across_mass[0].data());
        (uu * per_area).store(torque.across_mass[1].data());
        (zero - uv * per_area).store(torque.across_mass[2].data());
        const L difference = half * (uu - vv);
        (scale * inverse_or_zero(half * (uu + vv) + sqrt(mul_add(difference, difference, uv * uv))))
            .store(torque.least_mass.data());
        Rows before{};
        for (size_t i = 0; i < kLanes; ++i) {
          const uint32_t source = order_[m * kLanes + i];
          if (source == kNone || p >= contacts[source].count) continue;
          const Vec3f& torque_nm = contacts[source].contacts[p].torque_nm;
          for (size_t k = 0; k < 3; ++k) {
            before[k][i] = static_cast<T>(torque_nm[static_cast<Eigen::Index>(k)] * substep_s);
          }
        }
        const Lanes3<T> world = load3<T>(before);
        store3<T>({dot(n, world), dot(u, world), dot(v, world)}, torque.given);
      }
    }
  });
}

// Applies the torques of the last step: warm starting.
void ContactSolver::apply_torques(const Block& block) {
  Spins<T> spins(block, motions_);
  const Sym<T> inertia_a = load_sym<T>(block.inertia_a), inertia_b = load_sym<T>(block.inertia_b);
  for (uint32_t p = block.first_point; p < block.first_point + block.points; ++p) {
    const Torque& torque = torques_[p];
    const Lanes3<T> n = load3<T>(points_[p].normal), u = load3<T>(torque.across);
    spins.apply(inertia_a, inertia_b, in_world(n, u, cross(n, u), load3<T>(torque.given)));
  }
  spins.scatter(block, motions_, moving_);
}

// Takes away the turning of bodies against each other as far as the pushes of the points allow, as
// those are now. Along the normal and across it are limited apart; across it the limit is a disc.
void ContactSolver::hold_turning(const Block& block, bool of_impact) {
  using L = Lanes<T>;
  Spins<T> spins(block, motions_);
  const Sym<T> inertia_a = load_sym<T>(block.inertia_a), inertia_b = load_sym<T>(block.inertia_b);
  const L zero(T{0}), one(T{1});
  for (uint32_t p = block.first_point; p < block.first_point + block.points; ++p) {
    Torque& torque = torques_[p];
    Rows& given = of_impact ? torque.impact : torque.given;
    const L push = L::load(of_impact ? impulses_[p].push.data() : points_[p].push.data());
    const Lanes3<T> n = load3<T>(points_[p].normal), u = load3<T>(torque.across), v = cross(n, u);
    const Lanes3<T> old = load3<T>(given);
    const L most_along = L::load(torque.spinning.data()) * push;
    const L most_across = L::load(torque.rolling.data()) * push;

    Lanes3<T> held;
    const auto turning_now = [&] {
      return block.has_surfaces ? spins.relative() + load3<T>(running_[p].spin) : spins.relative();
    };
    const L along = neg_mul_add(L::load(torque.along_mass.data()), dot(n, turning_now()), old.x);
    held.x = max(zero - most_along, min(along, most_along));
    spins.apply(inertia_a, inertia_b, (held.x - old.x) * n);

    const Lanes3<T> turning = turning_now();
    const L by_u = dot(u, turning), by_v = dot(v, turning);
    // The torque that would stop it; where that is too much, a step against the turning that stops
    // no direction by more than its speed, within the limit.
    const L uu = L::load(torque.across_mass[0].data()), vv = L::load(torque.across_mass[1].data());
    const L uv = L::load(torque.across_mass[2].data());
    const L stop_u = neg_mul_add(uu, by_u, neg_mul_add(uv, by_v, old.y));
    const L stop_v = neg_mul_add(uv, by_u, neg_mul_add(vv, by_v, old.z));
    const L least = L::load(torque.least_mass.data());
    const L against_u = neg_mul_add(least, by_u, old.y),
            against_v = neg_mul_add(least, by_v, old.z);
    const L size2 = mul_add(against_u, against_u, against_v * against_v);
    const auto some = size2 > zero;
    const L share = min(select(some, most_across / sqrt(select(some, size2, one)), zero), one);
    const auto turns_on = mul_add(stop_u, stop_u, stop_v * stop_v) > most_across * most_across;
    held.y = select(turns_on, share * against_u, stop_u);
    held.z = select(turns_on, share * against_v, stop_v);
    spins.apply(inertia_a, inertia_b, add_scaled((held.y - old.y) * u, held.z - old.z, v));
    store3<T>(held, given);
  }
  spins.scatter(block, motions_, moving_);
}

void ContactSolver::store_torques(std::span<const ContactRange> contacts, double substep_s) const {
  const auto per_second = static_cast<T>(1 / substep_s);
  parallel_for(blocks_.size(), kGrain, [&](size_t begin, size_t end) {
    for (size_t m = begin; m < end; ++m) {
      const Block& block = blocks_[m];
      if (!block.holds_turning) continue;
      for (uint32_t p = 0; p < block.points; ++p) {
        const Torque& torque = torques_[block.first_point + p];
        const Lanes3<T> n = load3<T>(points_[block.first_point + p].normal);
        const Lanes3<T> u = load3<T>(torque.across);
        Rows world;
        store3<T>(in_world(n, u, cross(n, u), load3<T>(torque.given)), world);
        for (size_t i = 0; i < kLanes; ++i) {
          const uint32_t source = order_[m * kLanes + i];
          if (source == kNone || p >= contacts[source].count) continue;
          for (size_t k = 0; k < 3; ++k) {
            contacts[source].contacts[p].torque_nm[static_cast<Eigen::Index>(k)] =
                static_cast<float>(world[k][i] * per_second);
          }
        }
      }
    }
  });
}

}  // namespace pilesim::exact
