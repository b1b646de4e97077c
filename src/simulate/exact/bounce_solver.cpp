// The part of the contact solver that solves impacts, before the substeps.
//
// Impacts come in rounds. In a round some pairs collide and part at the speed that their
// restitution asks for. What they move presses on contacts that carry a load, or do not bounce:
// these pass the impulse on, so that a box that falls on one that lies parts from it as it would
// from the ground. What touches without a load is free to move; if it comes nearer now it collides
// in the next round. So an impulse goes through a row of balls from one to the next, whether they
// touch or there are gaps that a step jumps over.
//
// Gauss-Seidel sweeps alone need as many sweeps as the ratio of masses. So a sweep's change of the
// impulses is but a direction: of what it and the step before it span, each island takes the
// combination that leaves the least error (a conjugate gradient whose preconditioner is the sweep).
#include <algorithm>
#include <limits>
#include <numeric>

#include "simulate/exact/contact_lanes.h"
#include "simulate/exact/exact_constants.h"

namespace pilesim::exact {

using namespace exact_constants;

void ContactSolver::solve_impacts(const SolverSettings& settings) {
  if (std::ranges::none_of(blocks_, &Block::has_impacts)) return;
  former_.resize(points_.size());
  least_impact_ = static_cast<T>(settings.step_s * settings.gravity.norm());
  for (int round = 1; round <= kImpactRounds; ++round) {
    impulses_.assign(points_.size(), {});
    for (Torque& torque : torques_) torque.blow = {};
    const std::vector<Motion> before = motions_;
    converge(settings);
    sum_impulses(before);
    for_blocks(
        [&](size_t, Block& block) { find_impacts(block, settings, round + 1 == kImpactRounds); });
    if (std::ranges::none_of(blocks_, &Block::has_impacts)) break;
  }
}

// Linear velocities from those `before` and the sum of the impulses: the many small changes of the
// sweeps would each round, and lose momentum.
void ContactSolver::sum_impulses(std::span<const Motion> before) {
  for (size_t i = 0; i < moving_; ++i) std::copy_n(before[i].v.begin(), 3, motions_[i].v.begin());
  for_blocks([&](size_t, Block& block) {
    for (size_t i = 0; i < kLanes; ++i) {
      V3 sum = V3::Zero();
      for (uint32_t p = block.first_point; p < block.first_point + block.points; ++p) {
        const Impulse& impulse = impulses_[p];
        for (size_t k = 0; k < 3; ++k) {
          sum[static_cast<Eigen::Index>(k)] +=
              impulse.push[i] * points_[p].normal[k][i] + impulse.friction[k][i];
        }
      }
      if (sum.isZero(0)) continue;
      const auto add = [&](uint32_t body, const V3& change) {
        if (body >= moving_) return;
        for (size_t k = 0; k < 3; ++k) motions_[body].v[k] += change[static_cast<Eigen::Index>(k)];
      };
      add(block.a[i], -block.inverse_mass_a[i] * sum);
      add(block.b[i], block.inverse_mass_b[i] * sum);
    }
  });
}

// The impacts of a round. Only what they reach is visited, and again only when what was found there
// no longer holds.
void ContactSolver::converge(const SolverSettings& settings) {
  struck_.assign(motions_.size(), 0);
  changed_.assign(motions_.size(), 0);
  for (Block& block : blocks_) {
    block.reached = {};
    block.is_settled = !block.has_impacts;
    block.visited = 0;
  }
  directions_.clear();
  const auto per_step = static_cast<T>(1 / settings.step_s);
  std::vector<uint8_t> has_changed(batches_.size());
  for (int sweep = 0; sweep < kImpactSweeps; ++sweep) {
    std::ranges::fill(has_changed, 0);
    const auto begin = static_cast<uint32_t>(static_cast<size_t>(sweep) * (blocks_.size() + 1) + 1);
    const bool is_to_combine = sweep >= kPlainSweeps && sweep + 1 < kImpactSweeps;
    for_blocks([&](size_t batch, Block& block) {
      const auto now = begin + static_cast<uint32_t>(&block - blocks_.data());
      if (is_to_visit(block) && collide(block, per_step, now)) has_changed[batch] = 1;
    });
    if (std::ranges::find(has_changed, 1) == has_changed.end()) break;
    if (is_to_combine) {
      accelerate(per_step, begin, begin + static_cast<uint32_t>(blocks_.size()));
    }
  }
}

// Whether its points do not agree yet, or impulses have changed what its bodies do since.
HWY_INLINE bool ContactSolver::is_to_visit(const Block& block) const {
  if (!block.is_settled) return true;
  uint32_t last = 0;
  for (size_t i = 0; i < kLanes; ++i) {
    last = std::max({last, changed_[block.a[i]], changed_[block.b[i]]});
  }
  return last > block.visited;
}

// What collides is to part at its speed; what an impulse has reached, and passes it on, is not to
// come nearer than it was. The rest is left alone. Whether it has changed anything.
bool ContactSolver::collide(Block& block, T inverse_step, uint32_t now) {
  using L = Lanes<T>;
  bool is_reached = false;
  for (size_t i = 0; i < kLanes; ++i) {
    const bool is_passed =
        block.passes[i] > 0 && (struck_[block.a[i]] != 0 || struck_[block.b[i]] != 0);
    block.reached[i] = block.impact[i] > 0 || is_passed ? T{1} : T{0};
    is_reached = is_reached || block.reached[i] > 0;
  }
  block.visited = now;
  block.is_settled = true;
  if (!is_reached) return false;
  Gathered g = gather(block);
  const Weights<T, Block> weights(block);
  const Lanes3<T> between = load3<T>(block.between);
  const L zero(T{0}), one(T{1}), friction = L::load(block.friction.data()), rate(inverse_step);
  const auto moves = L::load(block.reached.data()) > zero;
  const L lighter = max(weights.mass_a, weights.mass_b);
  const L smaller = min(weights.mass_a, weights.mass_b);
  const L heavier = select(smaller > zero, smaller, lighter);
  const L share(static_cast<T>(kSameImpulse)), least = share * L(least_impact_);
  for (uint32_t p = block.first_point; p < block.first_point + block.points; ++p) {
    former_[p] = impulses_[p];
  }
  Row has_changed{};
  // Friction and push of a corner bear on each other: points are iterated until they agree.
  bool has_changed_any = false;
  for (int iteration = 0; iteration < kImpactIterations; ++iteration) {
    L change = zero, size = zero;
    for (uint32_t p = block.first_point; p < block.first_point + block.points; ++p) {
      const Point& point = points_[p];
      Impulse& impulse = impulses_[p];
      const Lanes3<T> n = load3<T>(point.normal), arm_a = load3<T>(point.arm);
      const Lanes3<T> arm_b = arm_a + between;
      const PointStart& start = starts_[p];
      const L speed = L::load(start.bounce.data());
      const L gap = max(L::load(start.distance.data()), zero);
      const L target = select(speed > zero, speed, zero - rate * gap);
      Lanes3<T> dv = relative<T>(g, arm_a, arm_b);
      const L lacking = target - dot(n, dv);
      const L old_push = L::load(impulse.push.data());
      const L push = select(
          moves, max(mul_add(L::load(point.mass_along.data()), lacking, old_push), zero), zero);
      push.store(impulse.push.data());
      dv = add_scaled(dv, push - old_push, load3<T>(point.answer));
      const Lanes3<T> old_friction = load3<T>(impulse.friction);
      const Lanes3<T> held =
          hold_back(dv, n, L::load(point.mass_across.data()), friction * push, old_friction);
      store3<T>(held, impulse.friction);
      const Lanes3<T> given = add_scaled(held - old_friction, push - old_push, n);
      weights.apply(given, arm_a, arm_b, g);
      change = max(change, dot(given, given));
      size = max(size, push * push);
    }
    const L changed = lighter * lighter * change, felt = share * heavier;
    const auto differ = hn::And(changed > felt * felt * size, changed > least * least);
    Row more;
    select(differ, one, zero).store(more.data());
    block.is_settled = std::ranges::none_of(more, [](T lane) { return lane > 0; });
    if (block.is_settled) break;
    has_changed_any = true;
    for (size_t i = 0; i < kLanes; ++i) has_changed[i] = std::max(has_changed[i], more[i]);
  }
  L felt = zero;  // m/s, by the lighter of the two
  for (uint32_t p = block.first_point; p < block.first_point + block.points; ++p) {
    felt = mul_add(L::load(impulses_[p].push.data()), lighter, felt);
  }
  Row strikes;
  select(felt > L(least_impact_), one, zero).store(strikes.data());
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

// Goes on from the sweep that began at `begin`, by islands: by s d + t e, where d is what the sweep
// has changed of the impulses and e what the step before it has, so that least is left of
// sum(impulse (velocity / 2 - target)): a system of two unknowns. Only points that push have part,
// and go on no farther than to where the first of them would pull.
void ContactSolver::accelerate(T inverse_step, uint32_t begin, uint32_t end) {
  struct Island {
    bool is_open = false;  // the sweep has changed something
    double dd = 0, de = 0, ee = 0, d = 0, e = 0, noise = 0, s = 0, t = 0, part = 1;
  };
  const size_t lanes = blocks_.size() * kLanes;
  if (directions_.empty()) directions_.assign(points_.size(), {});
  std::vector<uint32_t> parent(moving_);
  std::iota(parent.begin(), parent.end(), 0U);
  const auto find = [&](uint32_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  for (const Block& block : blocks_) {
    for (size_t i = 0; i < kLanes; ++i) {
      const uint32_t a = block.a[i], b = block.b[i];
      if (block.reached[i] > 0 && a < moving_ && b < moving_) parent[find(a)] = find(b);
    }
  }
  std::vector<Island> islands(moving_);
  for (uint32_t i = 0; i < moving_; ++i) {
    if (changed_[i] >= begin) islands[find(i)].is_open = true;
  }
  const auto row = [](const Rows& rows, size_t i) {
    return V3(rows[0][i], rows[1][i], rows[2][i]);
  };
  // The points of open islands: by visit(island, a, b, point, lane, normal, arm_a, arm_b, block).
  const auto for_points = [&](const auto& visit) {
    for (size_t m = 0; m < lanes; ++m) {
      Block& block = blocks_[m / kLanes];
      const size_t i = m % kLanes;
      if (!(block.reached[i] > 0)) continue;
      const uint32_t a = block.a[i], b = block.b[i];
      Island& island = islands[find(a < moving_ ? a : b)];
      if (!island.is_open) continue;
      const V3 between = row(block.between, i);
      for (uint32_t p = block.first_point; p < block.first_point + block.points; ++p) {
        const V3 arm = row(points_[p].arm, i);
        visit(island, a, b, p, i, row(points_[p].normal, i), arm, V3(arm + between), block);
      }
    }
  };
  // Of the pushes alone: friction beyond its limit would feed the bodies.
  const auto change_of = [&](const Block& block, uint32_t p, size_t i, const V3& n) -> V3 {
    const T change = block.visited < begin ? T{0} : impulses_[p].push[i] - former_[p].push[i];
    return change * n;
  };
  const auto direction_of = [&](uint32_t p, size_t i, const V3& n) -> V3 {
    return directions_[p].push[i] * n;
  };
  const auto apply = [&](std::vector<Motion>& motions, uint32_t body, const V3& impulse,
                         const V3& arm) {
    if (body >= moving_) return;
    const auto& inverse = inverse_[body].v;
    const V3 l = arm.cross(impulse);
    auto& v = motions[body].v;
    for (size_t k = 0; k < 3; ++k) v[k] += inverse[6] * impulse[static_cast<Eigen::Index>(k)];
    v[3] += inverse[0] * l.x() + inverse[3] * l.y() + inverse[4] * l.z();
    v[4] += inverse[3] * l.x() + inverse[1] * l.y() + inverse[5] * l.z();
    v[5] += inverse[4] * l.x() + inverse[5] * l.y() + inverse[2] * l.z();
  };
  const auto velocity_at = [](const Motion& motion, const V3& arm) -> V3 {
    return V3(motion.v[0], motion.v[1], motion.v[2]) +
           V3(motion.v[3], motion.v[4], motion.v[5]).cross(arm);
  };
  // What d and e change of the velocities.
  by_change_.assign(motions_.size(), {});
  by_direction_.assign(motions_.size(), {});
  for_points([&](Island&, uint32_t a, uint32_t b, uint32_t p, size_t i, const V3& n,
                 const V3& arm_a, const V3& arm_b, const Block& block) {
    if (!(impulses_[p].push[i] > 0)) return;
    const V3 d = change_of(block, p, i, n), e = direction_of(p, i, n);
    apply(by_change_, a, -d, arm_a);
    apply(by_change_, b, d, arm_b);
    apply(by_direction_, a, -e, arm_a);
    apply(by_direction_, b, e, arm_b);
  });
  for_points([&](Island& island, uint32_t a, uint32_t b, uint32_t p, size_t i, const V3& n,
                 const V3& arm_a, const V3& arm_b, const Block& block) {
    if (!(impulses_[p].push[i] > 0)) return;
    const V3 d = change_of(block, p, i, n), e = direction_of(p, i, n);
    const PointStart& start = starts_[p];
    const T target =
        start.bounce[i] > 0 ? start.bounce[i] : -inverse_step * std::max(start.distance[i], T{0});
    const V3 of_a = velocity_at(motions_[a], arm_a), of_b = velocity_at(motions_[b], arm_b);
    const V3 lacking = target * n - (of_b - of_a);
    const V3 by_d = velocity_at(by_change_[b], arm_b) - velocity_at(by_change_[a], arm_a);
    const V3 by_e = velocity_at(by_direction_[b], arm_b) - velocity_at(by_direction_[a], arm_a);
    island.dd += d.dot(by_d);
    island.de += d.dot(by_e);
    island.ee += e.dot(by_e);
    island.d += d.dot(lacking);
    island.e += e.dot(lacking);
    island.noise += d.norm() * std::max(of_a.norm(), of_b.norm());
  });
  for (Island& island : islands) {
    // Below that the change is rounding.
    constexpr double kRounding = 16 * std::numeric_limits<T>::epsilon();
    island.is_open = island.is_open && island.dd > kRounding * island.noise;
    if (!island.is_open) continue;
    island.s = island.d / island.dd;
    const double determinant = island.dd * island.ee - island.de * island.de;
    if (determinant > 1e-6 * island.dd * island.ee) {
      island.s = (island.d * island.ee - island.e * island.de) / determinant;
      island.t = (island.e * island.dd - island.d * island.de) / determinant;
    }
  }
  const auto step_of = [&](const Island& island, const Block& block, T now, T former, T direction) {
    const double d = block.visited < begin ? 0 : now - former;
    return static_cast<T>(island.s * d + island.t * direction);
  };
  for_points([&](Island& island, uint32_t, uint32_t, uint32_t p, size_t i, const V3&, const V3&,
                 const V3&, const Block& block) {
    const T now = impulses_[p].push[i];
    if (!(now > 0)) return;
    const T step = step_of(island, block, now, former_[p].push[i], directions_[p].push[i]);
    if (now + island.part * step < 0) island.part = -now / step;
  });
  for_points([&](Island& island, uint32_t a, uint32_t b, uint32_t p, size_t i, const V3& n,
                 const V3& arm_a, const V3& arm_b, const Block& block) {
    Impulse &now = impulses_[p], &direction = directions_[p];
    const Impulse& former = former_[p];
    const bool is_visited = block.visited >= begin, has_part = now.push[i] > 0;
    const auto part = static_cast<T>(island.part);
    const auto go_on = [&](T& value, T before, T& way) {
      const T step = has_part ? part * step_of(island, block, value, before, way) : T{0};
      way = step + (is_visited ? value - before : T{0});
      value += step;
      return step;
    };
    const T push = go_on(now.push[i], former.push[i], direction.push[i]);
    const V3 given = push * n;
    apply(motions_, a, -given, arm_a);
    apply(motions_, b, given, arm_b);
  });
  for (uint32_t i = 0; i < moving_; ++i) {
    if (islands[find(i)].is_open) changed_[i] = end;
  }
}

// What comes nearer now that impulses have changed the velocities of its bodies: it collides in the
// next round if it reaches the other within the step, and keeps its speed until then if it does
// not. In the last round nothing bounces any more, and all pass impulses on.
void ContactSolver::find_impacts(Block& block, const SolverSettings& settings, bool is_last) {
  using L = Lanes<T>;
  for (size_t i = 0; i < kLanes; ++i)
    block.bounced[i] = std::max(block.bounced[i], block.impact[i]);
  block.has_impacts = false;
  block.impact = {};
  bool has_changed = false;
  for (size_t i = 0; i < kLanes; ++i) {
    has_changed = has_changed || changed_[block.a[i]] > 0 || changed_[block.b[i]] > 0;
  }
  if (!has_changed) return;
  const Gathered g = gather(block);
  const Weights<T, Block> weights(block);
  const Lanes3<T> between = load3<T>(block.between);
  const L zero(T{0}), one(T{1}), h(static_cast<T>(settings.step_s));
  const L restitution = L::load(block.restitution.data());
  const L hard = L(static_cast<T>(kHard / kShallow)) * L::load(block.shallow.data());
  const L substep(static_cast<T>(settings.step_s / settings.substeps));
  const auto may_bounce = hn::Or(min(weights.mass_a, weights.mass_b) > zero,
                                 hn::Not(L::load(block.bounced.data()) > zero));
  const auto is_free = hn::Not(L::load(block.passes.data()) > zero);
  const auto in_lanes = [](const Vec3& v) {
    return Lanes3<T>{L(static_cast<T>(v.x())), L(static_cast<T>(v.y())), L(static_cast<T>(v.z()))};
  };
  const L falls =
      select(weights.mass_b > zero, one, zero) - select(weights.mass_a > zero, one, zero);
  const Lanes3<T> fall = falls * in_lanes(settings.gravity * settings.step_s * settings.step_s / 2);
  L impact = zero;
  for (uint32_t p = block.first_point; p < block.first_point + block.points; ++p) {
    const Lanes3<T> n = load3<T>(points_[p].normal), arm_a = load3<T>(points_[p].arm);
    const Lanes3<T> of_a = g.velocity_a + cross(g.spin_a, arm_a);
    const Lanes3<T> of_b = g.velocity_b + cross(g.spin_b, arm_a + between);
    const L closing = dot(n, of_a - of_b);
    const L fastest = sqrt(max(dot(of_a, of_a), dot(of_b, of_b)));
    PointStart& start = starts_[p];
    const L at_end = L::load(start.distance.data()) - closing * h + dot(n, fall);
    // The sweeps have left a share of the speeds undone; that is no impact.
    const auto comes = hn::And(L::load(points_[p].mass_along.data()) > zero,
                               closing > L(static_cast<T>(kSameImpulse)) * fastest);
    const auto outlives = hn::And(comes, restitution * closing > L(least_impact_));
    const auto misses = at_end > L(static_cast<T>(kAsGood)) * closing * h;
    const auto collides =
        hn::And(hn::AndNot(misses, hn::Or(outlives, hn::And(comes, closing * h > hard))), is_free);
    impact = select(collides, one, impact);
    // Off what does not move it bounces once in a step: where it stands friction would feed it.
    L bounce =
        select(hn::And(hn::And(collides, outlives), may_bounce), restitution * closing, zero);
    if (is_last) bounce = zero;
    bounce.store(start.bounce.data());
    select(hn::And(outlives, misses), substep * closing, zero).store(start.slack.data());
  }
  if (is_last) std::ranges::fill(block.passes, T{1});
  impact.store(block.impact.data());
  block.has_impacts = std::ranges::any_of(block.impact, [](T lane) { return lane > 0; });
}

}  // namespace pilesim::exact
