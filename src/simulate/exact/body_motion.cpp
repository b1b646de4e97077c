// The part of the contact solver that moves bodies, and changes how they move.
#include "simulate/exact/contact_lanes.h"
#include "simulate/exact/exact_constants.h"
#include "simulate/free_rotation.h"

namespace pilesim::exact {

using namespace exact_constants;

// Contacts give in a substep what they gave in the last: to that is added gravity, what the body's
// own turning does to its spin, and the partner's contacts.
void ContactSolver::pull(size_t begin, size_t end, const SolverSettings& settings, T h,
                         bool first) {
  using L = Lanes<T>;
  const L share(1 / static_cast<T>(settings.substeps));
  Motion by_gravity{};
  for (size_t k = 0; k < 3; ++k) {
    by_gravity.v[k] = static_cast<T>(settings.gravity[static_cast<Eigen::Index>(k)]) * h;
  }
  const L gained_by_gravity = L::load(by_gravity.v.data());
  for (size_t i = begin; i < end; ++i) {
    const L motion = L::load(motions_[i].v.data());
    const L given = L::load(given_[i].v.data()) + L::load(turned_[i].v.data());
    const L pulled = motion + share * given + gained_by_gravity;
    const L gained = motion - L::load(pulled_[i].v.data());
    pulled.store(pulled_[i].v.data());
    (first ? pulled : pulled + gained).store(motions_[i].v.data());
  }
}

// kLanes bodies at a time.
void ContactSolver::move(std::span<const SolverBody> bodies, size_t begin, size_t end,
                         const Vec3& gravity, T substep_s) {
  using L = Lanes<T>;
  const L zero(T{0}), one(T{1}), half(T{0.5});
  const Motion none{};
  for (size_t first = begin; first < end; first += kLanes) {
    const size_t count = std::min(kLanes, end - first);
    std::array<const T*, kLanes> of_motion, of_pulled, of_given, from_shift;
    std::array<T*, kLanes> of_shift;
    for (size_t i = 0; i < kLanes; ++i) {
      const bool is_there = i < count, moves = is_there && first + i < moving_;
      of_motion[i] = is_there ? motions_[first + i].v.data() : none.v.data();
      of_pulled[i] = moves ? pulled_[first + i].v.data() : none.v.data();
      of_given[i] = moves ? given_[first + i].v.data() : none.v.data();
      of_shift[i] = is_there ? shifts_[first + i].v.data() : nullptr;
      from_shift[i] = is_there ? shifts_[first + i].v.data() : none.v.data();
    }
    std::array<L, 8> motion, pulled, given, shift;
    gather8(of_motion.data(), motion);
    gather8(of_pulled.data(), pulled);
    gather8(of_given.data(), given);
    gather8(from_shift.data(), shift);
    const L h = L(substep_s) * shift[7];
    Row led;  // bodies that contacts do not move
    for (size_t i = 0; i < kLanes; ++i) led[i] = first + i < moving_ ? T{0} : T{1};
    const auto is_led = L::load(led.data()) > zero;
    auto touched = is_led;
    for (size_t k = 0; k < 6; ++k) {
      touched =
          hn::Or(touched, hn::Or(hn::Ne(motion[k].v, pulled[k].v), hn::Ne(given[k].v, zero.v)));
    }
    for (size_t k = 0; k < 3; ++k) {
      const L parabola = half * (L(static_cast<T>(gravity[static_cast<Eigen::Index>(k)])) * h * h);
      shift[k] = shift[k] + h * motion[k] - select(touched, zero, parabola);
    }
    // The turn by spin h, to fourth order: (s, c) ~ (sin, cos) of half of it.
    const Lanes3<T> turn = (half * h) * Lanes3<T>{motion[3], motion[4], motion[5]};
    const L half2 = dot(turn, turn);
    const L s = one - half2 * (one / L(T{6})) + half2 * half2 * (one / L(T{120}));
    const L c = one - half * half2 + half2 * half2 * (one / L(T{24}));
    const Lanes3<T> step = s * turn, before = {shift[3], shift[4], shift[5]};
    const Lanes3<T> after = cross(step, before) + c * before + shift[6] * step;
    const L w = c * shift[6] - dot(step, before);
    const L size2 = dot(after, after) + w * w;
    const L scale = one / sqrt(select(size2 > zero, size2, one));
    constexpr auto kMost = static_cast<T>(kLeastTurn * kLeastTurn / 4);
    const auto is_slow = hn::And(half2 > zero, hn::Not(half2 > L(kMost)));
    const auto turns = hn::Or(is_slow, hn::And(half2 > zero, is_led));
    shift[3] = select(turns, scale * after.x, before.x);
    shift[4] = select(turns, scale * after.y, before.y);
    shift[5] = select(turns, scale * after.z, before.z);
    shift[6] = select(turns, scale * w, shift[6]);
    const auto is_fast = hn::AndNot(turns, half2 > zero);
    Row fast, times;
    select(is_fast, one, zero).store(fast.data());
    h.store(times.data());
    const bool any = !hn::AllFalse(L::Tag(), is_fast);
    scatter8(shift, of_shift.data());
    for (size_t i = 0; any && i < count; ++i) {
      if (fast[i] > 0) turn_freely(bodies[first + i], first + i, static_cast<double>(times[i]));
    }
  }
}

// The axis of a fast turning body turns, too.
void ContactSolver::turn_freely(const SolverBody& body, size_t i, double h) {
  Motion& motion = motions_[i];
  Shift& shift = shifts_[i];
  Quat turn(shift.v[6], shift.v[3], shift.v[4], shift.v[5]);
  Vec3 spin(motion.v[3], motion.v[4], motion.v[5]);
  rotate_freely(body.moments, body.axes, h, turn, spin);
  shift.v[3] = static_cast<T>(turn.x());
  shift.v[4] = static_cast<T>(turn.y());
  shift.v[5] = static_cast<T>(turn.z());
  shift.v[6] = static_cast<T>(turn.w());
  for (size_t k = 0; k < 3; ++k) {
    const auto after = static_cast<T>(spin[static_cast<Eigen::Index>(k)]);
    pulled_[i].v[k + 3] += after - motion.v[k + 3];  // no contact's doing
    motion.v[k + 3] = after;
  }
}

Vec3 ContactSolver::velocity(uint32_t body) const {
  const Motion& motion = motions_[body];
  return Vec3(motion.v[0], motion.v[1], motion.v[2]);
}

Vec3 ContactSolver::spin(uint32_t body) const {
  const Motion& motion = motions_[body];
  return Vec3(motion.v[3], motion.v[4], motion.v[5]);
}

Quat ContactSolver::turn_of(uint32_t body) const {
  const Shift& shift = shifts_[body];
  return Quat(shift.v[6], shift.v[3], shift.v[4], shift.v[5]);
}

Vec3 ContactSolver::displacement_of(uint32_t body) const {
  const Shift& shift = shifts_[body];
  return Vec3(shift.v[0], shift.v[1], shift.v[2]);
}

void ContactSolver::change_velocity(uint32_t body, const Vec3& linear, const Vec3& angular) {
  add_velocity(body, linear, angular);
  for (size_t k = 0; k < 3; ++k) {
    given_[body].v[k] += static_cast<T>(linear[static_cast<Eigen::Index>(k)]);
    given_[body].v[k + 3] += static_cast<T>(angular[static_cast<Eigen::Index>(k)]);
  }
}

void ContactSolver::set_velocity(uint32_t body, const Vec3& linear, const Vec3& angular) {
  Motion& motion = motions_[body];
  for (size_t k = 0; k < 3; ++k) {
    motion.v[k] = static_cast<T>(linear[static_cast<Eigen::Index>(k)]);
    motion.v[k + 3] = static_cast<T>(angular[static_cast<Eigen::Index>(k)]);
  }
}

void ContactSolver::add_velocity(uint32_t body, const Vec3& linear, const Vec3& angular) {
  Motion& motion = motions_[body];
  for (size_t k = 0; k < 3; ++k) {
    motion.v[k] += static_cast<T>(linear[static_cast<Eigen::Index>(k)]);
    motion.v[k + 3] += static_cast<T>(angular[static_cast<Eigen::Index>(k)]);
  }
}

}  // namespace pilesim::exact
