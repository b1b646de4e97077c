// The part of the contact solver that bounces.
#include <algorithm>

#include "simulate/exact/contact_lanes.h"
#include "simulate/exact/exact_constants.h"

namespace pilesim::exact {

using namespace exact_constants;

namespace {

constexpr size_t kBlockGrain = 8;
// With fewer one thread is as fast.
constexpr size_t kLeastBlocks = 48;

}  // namespace

// Those that bounce are few, with those that a blow has reached: so only they are visited, and by
// one thread where it is as fast.
template <typename T>
void ContactSolver<T>::bounce_all(Team& team, const SolverSettings& settings) {
  if (std::ranges::none_of(blocks_, [](const Block& block) { return block.bounces; })) return;
  blows_.assign(points_.size(), {});
  struck_.assign(motions_.size(), 0);
  least_blow_ = static_cast<T>(settings.step_s * settings.gravity.norm());
  const auto per_step = static_cast<T>(1 / settings.step_s);
  const auto is_struck = [&](uint32_t body) { return struck_[body] != 0; };
  std::vector<uint32_t> which;  // blocks, colour by colour
  std::vector<size_t> first;    // of each colour that has any
  std::ptrdiff_t known = -1;    // bodies that blows had reached when they were listed
  for (int i = 0; i < kBounceSweeps; ++i) {
    const std::ptrdiff_t reached = std::ranges::count(struck_, 1);
    if (reached != known) {
      known = reached;
      which.clear();
      first = {0};
      for (size_t k = 0; k + 1 < colour_first_.size(); ++k) {
        for (uint32_t m = colour_first_[k]; m < colour_first_[k + 1]; ++m) {
          const Block& block = blocks_[m];
          if (block.bounces || std::ranges::any_of(block.a, is_struck) ||
              std::ranges::any_of(block.b, is_struck)) {
            which.push_back(m);
          }
        }
        if (which.size() > first.back()) first.push_back(which.size());
      }
    }
    Team alone;
    Team& helped = which.size() < kLeastBlocks ? alone : team;
    for (size_t k = 0; k + 1 < first.size(); ++k) {
      const size_t count = first[k + 1] - first[k];
      const size_t grain = blocks_[which[first[k]]].lanes == 1 ? count : kBlockGrain;
      helped.parallel_for(count, grain, [&](size_t begin, size_t end) {
        for (size_t m = begin; m < end; ++m) bounce(blocks_[which[first[k] + m]], per_step);
      });
    }
    if (std::ranges::all_of(which, [&](uint32_t m) { return blocks_[m].is_settled; })) break;
  }
}

// What bounces is to part at its speed. What it moves moves what that touches in turn, which is not
// to come nearer than it was: a box that falls on one that lies would else spend its bounce on
// pressing that one into the ground. What no blow has reached is left alone.
template <typename T>
void ContactSolver<T>::bounce(Block& block, T inverse_step) {
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
  block.is_settled = true;
  if (!is_reached) return;
  Gathered g = gather(block);
  const Weights<T, Block> weights(block);
  const Lanes3<T> between = load3<T>(block.between);
  const L zero(T{0}), one(T{1}), friction = L::load(block.friction.data()), rate(inverse_step);
  const auto moves = L::load(reached.data()) > zero;
  // Friction and push of a corner that hits bear on each other: points are gone over until they
  // agree, or a blow would be a share of what it is.
  for (int round = 0; round < kBounceRounds; ++round) {
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
    if (std::ranges::none_of(more, [](T lane) { return lane > 0; })) break;
    block.is_settled = false;
  }
  Row felt{};  // m/s, by the lighter of the two
  for (uint32_t p = block.first_point; p < block.first_point + block.points; ++p) {
    for (size_t i = 0; i < kLanes; ++i) {
      felt[i] += blows_[p].push[i] * std::max(block.inverse_mass_a[i], block.inverse_mass_b[i]);
    }
  }
  scatter(block, g);
  if (block.holds_turning) hold_turning(block, true);
  for (size_t i = 0; i < kLanes; ++i) {
    if (felt[i] <= least_blow_) continue;
    if (block.a[i] < moving_) struck_[block.a[i]] = 1;
    if (block.b[i] < moving_) struck_[block.b[i]] = 1;
  }
}

template void ContactSolver<float>::bounce_all(Team&, const SolverSettings&);
template void ContactSolver<double>::bounce_all(Team&, const SolverSettings&);
template void ContactSolver<float>::bounce(Block&, float);
template void ContactSolver<double>::bounce(Block&, double);

}  // namespace pilesim::exact
