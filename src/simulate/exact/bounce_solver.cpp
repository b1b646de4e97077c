// The part of the contact solver that bounces.
#include <algorithm>

#include "simulate/exact/contact_lanes.h"
#include "simulate/exact/exact_constants.h"

namespace pilesim::exact {

using namespace exact_constants;

// Those that bounce are few, with those that a blow has reached: so only they are visited, and
// again only when what they have found no longer holds.
template <typename T>
void ContactSolver<T>::bounce_all(const SolverSettings& settings) {
  if (std::ranges::none_of(blocks_, [](const Block& block) { return block.bounces; })) return;
  blows_.assign(points_.size(), {});
  struck_.assign(motions_.size(), 0);
  changed_.assign(motions_.size(), 0);
  for (Block& block : blocks_) {
    block.is_settled = !block.bounces;
    block.visited = 0;
  }
  least_blow_ = static_cast<T>(settings.step_s * settings.gravity.norm());
  const auto per_step = static_cast<T>(1 / settings.step_s);
  std::vector<uint8_t> has_changed(batches_.size());
  for (int sweep = 0; sweep < kBounceSweeps; ++sweep) {
    std::ranges::fill(has_changed, 0);
    const auto begin = static_cast<uint32_t>(static_cast<size_t>(sweep) * blocks_.size() + 1);
    for_blocks([&](size_t batch, Block& block) {
      const auto now = begin + static_cast<uint32_t>(&block - blocks_.data());
      if (is_to_bounce(block) && bounce(block, per_step, now)) has_changed[batch] = 1;
    });
    if (std::ranges::find(has_changed, 1) == has_changed.end()) break;
  }
}

// Whether its points do not agree yet, or blows have changed what its bodies do since. Of few: or
// any has reached them.
template <typename T>
HWY_INLINE bool ContactSolver<T>::is_to_bounce(const Block& block) const {
  if (!block.is_settled || (is_thorough_ && block.bounces)) return true;
  uint32_t last = 0;
  for (size_t i = 0; i < kLanes; ++i) {
    last = std::max({last, changed_[block.a[i]], changed_[block.b[i]]});
  }
  return last > (is_thorough_ ? 0 : block.visited);
}

// What bounces is to part at its speed. What it moves moves what that touches in turn, which is not
// to come nearer than it was: a box that falls on one that lies would else spend its bounce on
// pressing that one into the ground. What no blow has reached is left alone. Whether it has changed
// anything.
template <typename T>
bool ContactSolver<T>::bounce(Block& block, T inverse_step, uint32_t now) {
  using L = Lanes<T>;
  Row reached{};
  bool is_reached = false;
  for (size_t i = 0; i < kLanes; ++i) {
    bool is_hit = struck_[block.a[i]] != 0 || struck_[block.b[i]] != 0;
    for (uint32_t p = 0; p < block.points && block.bounces; ++p) {
      is_hit = is_hit || starts_[block.first_point + p].bounce[i] > 0;
    }
    reached[i] = is_hit ? T{1} : T{0};
    is_reached = is_reached || is_hit;
  }
  block.visited = now;
  block.is_settled = true;
  if (!is_reached) return false;
  Gathered g = gather(block);
  const Weights<T, Block> weights(block);
  const Lanes3<T> between = load3<T>(block.between);
  const L zero(T{0}), one(T{1}), friction = L::load(block.friction.data()), rate(inverse_step);
  const auto moves = L::load(reached.data()) > zero;
  Row has_changed{};
  // Friction and push of a corner that hits bear on each other: points are gone over until they
  // agree, or a blow would be a share of what it is.
  const int rounds = block.bounces || is_thorough_ ? kBounceRounds : 1;
  bool has_changed_any = false;
  for (int round = 0; round < rounds; ++round) {
    L change = zero, size = zero;
    for (uint32_t p = block.first_point; p < block.first_point + block.points; ++p) {
      const Point& point = points_[p];
      Blow& blow = blows_[p];
      const Lanes3<T> n = load3<T>(point.normal), arm_a = load3<T>(point.arm);
      const Lanes3<T> arm_b = arm_a + between;
      const PointStart& start = starts_[p];
      const L speed = L::load(start.bounce.data());
      const L gap = max(L::load(start.distance.data()), zero);
      const L target = select(speed > zero, speed, zero - rate * gap);
      Lanes3<T> dv = relative<T>(g, arm_a, arm_b);
      const L lacking = target - dot(n, dv);
      const L old_push = L::load(blow.push.data());
      const L push = select(
          moves, max(mul_add(L::load(point.mass_along.data()), lacking, old_push), zero), zero);
      push.store(blow.push.data());
      dv = add_scaled(dv, push - old_push, load3<T>(point.answer));
      const Lanes3<T> old_friction = load3<T>(blow.friction);
      const Lanes3<T> held =
          hold_back(dv, n, L::load(point.mass_across.data()), friction * push, old_friction);
      store3<T>(held, blow.friction);
      const Lanes3<T> given = add_scaled(held - old_friction, push - old_push, n);
      weights.apply(given, arm_a, arm_b, g);
      change = max(change, dot(given, given));
      size = max(size, push * push);
    }
    const L lighter = max(weights.mass_a, weights.mass_b),
            least(least_blow_ * static_cast<T>(kSameBlow));
    const auto differ =
        hn::And(change > L(static_cast<T>(kSameBlow) * static_cast<T>(kSameBlow)) * size,
                lighter * lighter * change > least * least);
    Row more;
    select(differ, one, zero).store(more.data());
    block.is_settled = std::ranges::none_of(more, [](T lane) { return lane > 0; });
    if (block.is_settled) break;
    has_changed_any = true;
    for (size_t i = 0; i < kLanes; ++i) has_changed[i] = std::max(has_changed[i], more[i]);
  }
  const L lighter = max(weights.mass_a, weights.mass_b);
  L felt = zero;  // m/s, by the lighter of the two
  for (uint32_t p = block.first_point; p < block.first_point + block.points; ++p) {
    felt = mul_add(L::load(blows_[p].push.data()), lighter, felt);
  }
  Row strikes;
  select(felt > L(least_blow_), one, zero).store(strikes.data());
  scatter(block, g);
  if (block.holds_turning) hold_turning(block, true);
  for (size_t i = 0; i < kLanes; ++i) {
    for (const uint32_t body : {block.a[i], block.b[i]}) {
      if (body >= moving_) continue;
      const bool is_new = strikes[i] > 0 && struck_[body] == 0;
      if (is_new) struck_[body] = 1;
      if (is_new || has_changed[i] > 0) changed_[body] = now;
    }
  }
  return has_changed_any;
}

template void ContactSolver<float>::bounce_all(const SolverSettings&);
template void ContactSolver<double>::bounce_all(const SolverSettings&);
template bool ContactSolver<float>::is_to_bounce(const Block&) const;
template bool ContactSolver<double>::is_to_bounce(const Block&) const;
template bool ContactSolver<float>::bounce(Block&, float, uint32_t);
template bool ContactSolver<double>::bounce(Block&, double, uint32_t);

}  // namespace pilesim::exact
