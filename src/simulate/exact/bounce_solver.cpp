// The part of the contact solver that solves impacts, before the substeps.
//
// Impacts come in rounds. In a round some pairs collide and part at the speed that their
// restitution asks for. Bodies that they move press on contacts that carry a load, or do not
// bounce: these pass the impulse on, so that a box that falls on one that lies parts from it as it
// would from the ground. Bodies that touch without a load are free to move; if they come nearer now
// they collide in the next round. So an impulse goes through a row of balls from one to the next,
// whether they touch or there are gaps that a step jumps over.
//
// Gauss-Seidel sweeps alone need as many sweeps as the ratio of masses. So a sweep's change of the
// impulses is but a direction: of what it and the step before it span, each island takes the
// combination that leaves the least error (a conjugate gradient whose preconditioner is the sweep).
#include <algorithm>
#include <limits>

#include "simulate/exact/contact_lanes.h"
#include "simulate/exact/exact_constants.h"

namespace pilesim::exact {

using namespace exact_constants;

void ContactSolver::solve_impacts(const SolverSettings& settings,
                                  std::span<const SolverJoint> joints) {
  if (std::ranges::none_of(blocks_, &Block::has_impacts)) return;
  find_partners(joints);
  impulses_.resize(points_.size());
  former_.resize(points_.size());
  directions_.resize(points_.size());
  least_impact_ = static_cast<T>(settings.step_s * settings.gravity.norm());
  least_change_ = static_cast<T>(kSameAsFall) * least_impact_;
  for (int round = 1; round <= kImpactRounds; ++round) {
    const std::vector<Motion> before = motions_;
    converge();
    find_gains(before);
    if (forbid_bounces()) {
      motions_ = before;
      converge();
      find_gains(before);
    }
    cancel_gains(before);
    sum_impulses(before);
    move_back(before);
    for_blocks(
        [&](size_t, Block& block) { find_impacts(block, settings, round + 1 == kImpactRounds); });
    if (std::ranges::none_of(blocks_, &Block::has_impacts)) break;
  }
  for_blocks([&](size_t, Block& block) { forgive_bounces(block); });
}

// How much more energy the impulses have given each island than the step's gravity can, twice that
// in J. Where bodies hook into each other, or one is wedged between others, not all contacts can
// bounce: the impulses for that grow from sweep to sweep.
void ContactSolver::find_gains(std::span<const Motion> before) {
  using L = Lanes<T>;
  constexpr double kGain = 0.01;  // less is what sweeps have left undone
  find_impact_islands(0);
  std::vector<uint8_t> is_counted(motions_.size(), 0);
  const auto allowed = [&](uint32_t body) {
    const auto& inverse = inverse_[body].v;
    const T mass = 1 / inverse[6], inertia = 3 / (inverse[0] + inverse[1] + inverse[2]);
    double sum = 0;
    for (const Motion* motion : {&before[body], static_cast<const Motion*>(&motions_[body])}) {
      const Eigen::Map<const V3> velocity(motion->v.data()), spin(motion->v.data() + 3);
      const double energy = mass * velocity.squaredNorm() + inertia * spin.squaredNorm();
      sum += kGain * energy + 4 * least_impact_ * std::sqrt(mass * energy);
    }
    return sum + 4 * mass * least_impact_ * least_impact_;
  };
  for (const uint32_t m : reached_blocks_) {
    const Block& block = blocks_[m];
    const Lanes3<T> between = load3<T>(block.between);
    const Gathered then = gather(block, before), now = gather(block, motions_);
    L gained(T{0});
    for (uint32_t p = block.first_point; p < block.first_point + block.points; ++p) {
      const Lanes3<T> arm_a = load3<T>(points_[p].arm), arm_b = arm_a + between;
      const Lanes3<T> given =
          add_scaled(load3<T>(impulses_[p].friction), L::load(impulses_[p].push.data()),
                     load3<T>(points_[p].normal));
      gained =
          gained + dot(given, relative<T>(then, arm_a, arm_b) + relative<T>(now, arm_a, arm_b));
    }
    Row gains;
    gained.store(gains.data());
    for (size_t i = 0; i < kLanes; ++i) {
      if (!(block.reached[i] > 0)) continue;
      ImpactIsland& island = impact_island(block, i);
      island.gained += gains[i];
      for (const uint32_t body : {block.a[i], block.b[i]}) {
        if (body >= moving_ || is_counted[body] != 0) continue;
        is_counted[body] = 1;
        island.gained -= allowed(body);
      }
    }
  }
}

// By visit(block, lane) of each contact of islands that have gained.
template <typename Visit>
void ContactSolver::for_gains(const Visit& visit) {
  for (const uint32_t m : reached_blocks_) {
    Block& block = blocks_[m];
    for (size_t i = 0; i < kLanes; ++i) {
      if (block.reached[i] > 0 && impact_island(block, i).gained > 0) visit(block, i);
    }
  }
}

// Islands that have gained bounce no more; whether any would have.
bool ContactSolver::forbid_bounces() {
  bool any = false;
  for_gains([&](const Block& block, size_t lane) {
    for (uint32_t p = block.first_point; p < block.first_point + block.points; ++p) {
      T& parting = starts_[p].parting[lane];
      any = any || parting > 0;
      parting = std::min(parting, T{0});
    }
  });
  return any;
}

// Leaves islands that have gained to the substeps.
void ContactSolver::cancel_gains(std::span<const Motion> before) {
  for_gains([&](const Block& block, size_t lane) {
    for (const uint32_t body : {block.a[lane], block.b[lane]}) motions_[body] = before[body];
    for (uint32_t p = block.first_point; p < block.first_point + block.points; ++p) {
      impulses_[p].push[lane] = 0;
      for (Row& row : impulses_[p].friction) row[lane] = 0;
    }
  });
}

// A body that meets only one other, and hangs on none, may be moved along its way without coming
// into another's.
void ContactSolver::find_partners(std::span<const SolverJoint> joints) {
  partners_.assign(motions_.size(), kNone);
  const auto meet = [&](uint32_t body, uint32_t other) {
    uint32_t& partner = partners_[body];
    partner = partner == kNone || partner == other ? other : kSeveral;
  };
  for (const Block& block : blocks_) {
    for (size_t i = 0; i < kLanes; ++i) {
      meet(block.a[i], block.b[i]);
      meet(block.b[i], block.a[i]);
    }
  }
  for (const SolverJoint& joint : joints) partners_[joint.a] = partners_[joint.b] = kSeveral;
}

// Linear velocities from those `before` and the sum of the impulses: the many small changes of the
// sweeps would each round, and lose momentum.
void ContactSolver::sum_impulses(std::span<const Motion> before) {
  for (size_t i = 0; i < moving_; ++i) std::copy_n(before[i].v.begin(), 3, motions_[i].v.begin());
  bounce_times_.assign(moving_, kNever);
  for_blocks([&](size_t, Block& block) {
    if (!block.is_reached) return;
    for (size_t i = 0; i < kLanes; ++i) {
      V3 sum = V3::Zero();
      T first_s = kNever;
      for (uint32_t p = block.first_point; p < block.first_point + block.points; ++p) {
        const Impulse& impulse = impulses_[p];
        if (impulse.push[i] > 0) first_s = std::min(first_s, starts_[p].impact[i]);
        for (size_t k = 0; k < 3; ++k) {
          sum[static_cast<Eigen::Index>(k)] +=
              impulse.push[i] * points_[p].normal[k][i] + impulse.friction[k][i];
        }
      }
      if (sum.isZero(0)) continue;
      const auto add = [&](uint32_t body, const V3& change) {
        if (body >= moving_) return;
        for (size_t k = 0; k < 3; ++k) motions_[body].v[k] += change[static_cast<Eigen::Index>(k)];
        if (partners_[body] == kSeveral) return;
        bounce_times_[body] = std::min(bounce_times_[body], first_s);
      };
      add(block.a[i], -block.inverse_mass_a[i] * sum);
      add(block.b[i], block.inverse_mass_b[i] * sum);
    }
  });
}

// A body that bounces some time into the step moves as before until then. Its new velocity holds
// all through the step: the body is moved back by what this adds, so that it ends the step where it
// should.
void ContactSolver::move_back(std::span<const Motion> before) {
  for (size_t i = 0; i < moving_; ++i) {
    const T back_s = bounce_times_[i];
    if (back_s == kNever || back_s == 0) continue;
    Shift& shift = shifts_[i];
    V3 turn;
    for (size_t k = 0; k < 3; ++k) {
      shift.v[k] -= back_s * (motions_[i].v[k] - before[i].v[k]);
      turn[static_cast<Eigen::Index>(k)] = back_s * (motions_[i].v[k + 3] - before[i].v[k + 3]);
    }
    const T angle = turn.norm();
    if (!(angle > 0)) continue;
    using Turn = Eigen::Quaternion<T>;
    const Turn back(Eigen::AngleAxis<T>(-angle, turn / angle));
    const Turn now = back * Turn(shift.v[6], shift.v[3], shift.v[4], shift.v[5]);
    std::copy_n(now.coeffs().data(), 4, shift.v.begin() + 3);
  }
}

// How much farther apart bodies are at a point since some were moved back, m.
HWY_INLINE Lanes<float> ContactSolver::moved_along(const Block& block, const Lanes3<T>& normal,
                                                   const Lanes3<T>& arm) const {
  const auto [a, b] = gather_shifts(block);
  const Lanes<T> two(T{2});
  const Lanes3<T> of_a =
      Lanes3<T>{a[0], a[1], a[2]} + two * cross(Lanes3<T>{a[3], a[4], a[5]}, arm);
  const Lanes3<T> of_b = Lanes3<T>{b[0], b[1], b[2]} +
                         two * cross(Lanes3<T>{b[3], b[4], b[5]}, arm + load3<T>(block.between));
  return dot(normal, of_b - of_a);
}

// Bodies that bounce were moved back into each other and part: at those points it is no overlap.
void ContactSolver::forgive_bounces(const Block& block) {
  using L = Lanes<T>;
  if (std::ranges::none_of(block.bounced, [](T lane) { return lane > 0; })) return;
  const L zero(T{0});
  for (uint32_t p = block.first_point; p < block.first_point + block.points; ++p) {
    PointStart& start = starts_[p];
    const L moved = moved_along(block, load3<T>(points_[p].normal), load3<T>(points_[p].arm));
    const auto has_bounced = L::load(start.impact.data()) > zero;
    (L::load(start.distance.data()) - select(has_bounced, min(moved, zero), zero))
        .store(start.distance.data());
  }
}

// The impacts of a round. Only what they reach is visited, and again only when what was found there
// no longer holds.
void ContactSolver::converge() {
  struck_.assign(motions_.size(), 0);
  changed_.assign(motions_.size(), 0);
  for (Block& block : blocks_) {
    block.reached = {};
    block.is_reached = false;
    block.is_settled = !block.has_impacts;
    block.visited = 0;
  }
  std::vector<uint8_t> has_changed(batches_.size());
  for (int sweep = 0; sweep < kImpactSweeps; ++sweep) {
    std::ranges::fill(has_changed, 0);
    const auto begin = static_cast<uint32_t>(static_cast<size_t>(sweep) * (blocks_.size() + 1) + 1);
    const bool is_to_combine = sweep > 0 && sweep + 1 < kImpactSweeps;
    for_blocks([&](size_t batch, Block& block) {
      const auto now = begin + static_cast<uint32_t>(&block - blocks_.data());
      if (is_to_visit(block) && collide(block, now)) has_changed[batch] = 1;
    });
    if (std::ranges::find(has_changed, 1) == has_changed.end()) break;
    if (is_to_combine) {
      accelerate(begin, begin + static_cast<uint32_t>(blocks_.size()));
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

// Only blocks that impulses reach have impulses of this round.
void ContactSolver::begin_impact(Block& block) {
  block.is_reached = true;
  for (uint32_t p = block.first_point; p < block.first_point + block.points; ++p) {
    impulses_[p] = {};
    directions_[p] = {};
    if (block.holds_turning) torques_[p].impact = {};
  }
}

// Colliding points separate at their speed; contacts that an impulse has reached, and that pass it
// on, are not to come nearer than they were. The rest is left alone. Whether it has changed
// anything.
bool ContactSolver::collide(Block& block, uint32_t now) {
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
  if (!block.is_reached) begin_impact(block);
  Gathered g = gather(block, motions_);
  const Weights<T, Block> weights(block);
  const Lanes3<T> between = load3<T>(block.between);
  const L zero(T{0}), one(T{1}), friction = L::load(block.friction.data());
  const auto moves = L::load(block.reached.data()) > zero;
  const L lighter = max(weights.mass_a, weights.mass_b);
  const L smaller = min(weights.mass_a, weights.mass_b);
  const L heavier = select(smaller > zero, smaller, lighter);
  L fastest = zero;  // at which it bounces
  for (uint32_t p = block.first_point; p < block.first_point + block.points; ++p) {
    former_[p] = impulses_[p].push;
    fastest = max(fastest, L::load(starts_[p].parting.data()));
  }
  const L lasting = max(one - L::load(block.restitution.data()), L(static_cast<T>(kSameBounce)));
  const L exactness = select(fastest > zero, lasting, one);
  const L share = exactness * L(static_cast<T>(kSameImpulse)), least = exactness * L(least_change_);
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
      Lanes3<T> dv = relative<T>(g, arm_a, arm_b);
      const L lacking = L::load(starts_[p].parting.data()) - dot(n, dv);
      const L old_push = L::load(impulse.push.data());
      const L push = select(
          moves, max(mul_add(L::load(point.mass_along.data()), lacking, old_push), zero), zero);
      push.store(impulse.push.data());
      dv = add_scaled(dv, push - old_push, load3<T>(point.answer));
      if (block.has_surfaces) dv = dv + load3<T>(running_[p].velocity);
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
  const L small = L(per_step_) * L::load(block.slop.data());
  select(felt > max(L(least_impact_), small), one, zero).store(strikes.data());
  scatter(block, g, motions_);
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
// sum(impulse (velocity / 2 - target)): a system of two unknowns. Only normal impulses have part,
// friction beyond its limit would feed the bodies; and they go on no farther than to where the
// first of them would pull.
void ContactSolver::accelerate(uint32_t begin, uint32_t end) {
  using L = Lanes<T>;
  find_impact_islands(begin);
  const L zero(T{0});
  // Visits the points that push of blocks in open islands, with d and e of their impulses.
  const auto for_points = [&](const Block& block, const auto& visit) {
    const auto reached = L::load(block.reached.data()) > zero;
    const L visited(block.visited < begin ? T{0} : T{1});
    for (uint32_t p = block.first_point; p < block.first_point + block.points; ++p) {
      const L now = L::load(impulses_[p].push.data());
      const auto has_part = hn::And(reached, now > zero);
      visit(p, now, select(has_part, visited * (now - L::load(former_[p].data())), zero),
            select(has_part, L::load(directions_[p].data()), zero));
    }
  };
  // The velocities that d and e add.
  for (const uint32_t m : open_blocks_) {
    const Block& block = blocks_[m];
    const Weights<T, Block> weights(block);
    const Lanes3<T> between = load3<T>(block.between);
    Gathered by_d = gather(block, by_change_), by_e = gather(block, by_direction_);
    for_points(block, [&](uint32_t p, L, L d, L e) {
      const Lanes3<T> n = load3<T>(points_[p].normal), arm = load3<T>(points_[p].arm);
      weights.apply(d * n, arm, arm + between, by_d);
      weights.apply(e * n, arm, arm + between, by_e);
    });
    scatter(block, by_d, by_change_);
    scatter(block, by_e, by_direction_);
  }
  for (const uint32_t m : open_blocks_) {
    const Block& block = blocks_[m];
    const Lanes3<T> between = load3<T>(block.between);
    const Gathered g = gather(block, motions_), of_d = gather(block, by_change_),
                   of_e = gather(block, by_direction_);
    std::array<L, 6> sums;
    sums.fill(zero);
    for_points(block, [&](uint32_t p, L, L d, L e) {
      const Lanes3<T> n = load3<T>(points_[p].normal), arm_a = load3<T>(points_[p].arm);
      const Lanes3<T> arm_b = arm_a + between;
      const Lanes3<T> of_a = g.velocity_a + cross(g.spin_a, arm_a);
      const Lanes3<T> of_b = g.velocity_b + cross(g.spin_b, arm_b);
      const L lacking = L::load(starts_[p].parting.data()) - dot(n, of_b - of_a);
      const L by_d = dot(n, relative<T>(of_d, arm_a, arm_b));
      const L by_e = dot(n, relative<T>(of_e, arm_a, arm_b));
      const L fastest = sqrt(max(dot(of_a, of_a), dot(of_b, of_b)));
      const std::array<L, 6> terms = {d * by_d,    d * by_e,    e * by_e,
                                      d * lacking, e * lacking, max(d, zero - d) * fastest};
      for (size_t k = 0; k < terms.size(); ++k) sums[k] = sums[k] + terms[k];
    });
    std::array<Row, 6> rows;
    for (size_t k = 0; k < rows.size(); ++k) sums[k].store(rows[k].data());
    for (size_t i = 0; i < kLanes; ++i) {
      if (!(block.reached[i] > 0)) continue;
      ImpactIsland& island = impact_island(block, i);
      island.dd += rows[0][i];
      island.de += rows[1][i];
      island.ee += rows[2][i];
      island.d += rows[3][i];
      island.e += rows[4][i];
      island.noise += rows[5][i];
    }
  }
  for (const uint32_t root : impact_roots_) impact_islands_[root].choose_step();
  // Factors of d and e, by lanes.
  const auto factors = [&](const Block& block, bool whole) {
    std::array<Row, 2> rows{};
    for (size_t i = 0; i < kLanes; ++i) {
      if (!(block.reached[i] > 0)) continue;
      const ImpactIsland& island = impact_island(block, i);
      const double part = whole ? 1 : island.part;
      if (!island.is_open) continue;
      rows[0][i] = static_cast<T>(part * island.s);
      rows[1][i] = static_cast<T>(part * island.t);
    }
    return std::array{L::load(rows[0].data()), L::load(rows[1].data())};
  };
  for (const uint32_t m : open_blocks_) {
    const Block& block = blocks_[m];
    const auto factor = factors(block, true);
    const L one(T{1});
    L part = one;
    for_points(block, [&](uint32_t, L now, L d, L e) {
      const L step = mul_add(factor[0], d, factor[1] * e);
      const auto pulls = zero > now + step;
      part = select(pulls, min(part, now / select(pulls, zero - step, one)), part);
    });
    Row row;
    part.store(row.data());
    for (size_t i = 0; i < kLanes; ++i) {
      if (!(block.reached[i] > 0)) continue;
      ImpactIsland& island = impact_island(block, i);
      island.part = std::min<double>(island.part, row[i]);
    }
  }
  for (const uint32_t m : open_blocks_) {
    const Block& block = blocks_[m];
    const Weights<T, Block> weights(block);
    const Lanes3<T> between = load3<T>(block.between);
    const auto factor = factors(block, false);
    Gathered g = gather(block, motions_);
    for_points(block, [&](uint32_t p, L now, L d, L e) {
      const L step = mul_add(factor[0], d, factor[1] * e);
      (now + step).store(impulses_[p].push.data());
      const L change = block.visited < begin ? zero : now - L::load(former_[p].data());
      (step + change).store(directions_[p].data());
      const Lanes3<T> arm = load3<T>(points_[p].arm);
      weights.apply(step * load3<T>(points_[p].normal), arm, arm + between, g);
    });
    scatter(block, g, motions_);
    for (size_t i = 0; i < kLanes; ++i) {
      if (!(block.reached[i] > 0) || !impact_island(block, i).is_open) continue;
      for (const uint32_t body : {block.a[i], block.b[i]}) {
        if (body < moving_) changed_[body] = end;
      }
    }
  }
}

// Islands of bodies that impulses have reached, and the blocks of those in which the sweep that
// began at `begin` has changed something.
void ContactSolver::find_impact_islands(uint32_t begin) {
  // Bodies that are not moved belong to no island.
  const auto for_reached = [&](const auto& visit) {
    for (const uint32_t m : reached_blocks_) {
      for (size_t i = 0; i < kLanes; ++i) {
        if (blocks_[m].reached[i] > 0) visit(m, blocks_[m].a[i], blocks_[m].b[i]);
      }
    }
  };
  reached_blocks_.clear();
  for (uint32_t m = 0; m < blocks_.size(); ++m) {
    if (blocks_[m].is_reached) reached_blocks_.push_back(m);
  }
  by_change_.resize(motions_.size());
  by_direction_.resize(motions_.size());
  impact_islands_.resize(motions_.size());
  if (impact_sets_.size() < motions_.size()) impact_sets_.reset(motions_.size());
  for_reached([&](uint32_t, uint32_t a, uint32_t b) {
    for (const uint32_t body : {a, b}) {
      impact_sets_.part(body);
      by_change_[body] = by_direction_[body] = {};
      impact_islands_[body] = {};
    }
  });
  for_reached([&](uint32_t, uint32_t a, uint32_t b) {
    if (a < moving_ && b < moving_) impact_sets_.unite(a, b);
  });
  const auto root_of = [&](uint32_t a, uint32_t b) {
    return impact_sets_.find(a < moving_ ? a : b);
  };
  impact_roots_.clear();
  for_reached([&](uint32_t, uint32_t a, uint32_t b) {
    ImpactIsland& island = impact_islands_[root_of(a, b)];
    if (island.is_open || std::max(changed_[a], changed_[b]) < begin) return;
    island.is_open = true;
    impact_roots_.push_back(root_of(a, b));
  });
  open_blocks_.clear();
  for_reached([&](uint32_t m, uint32_t a, uint32_t b) {
    const bool is_listed = !open_blocks_.empty() && open_blocks_.back() == m;
    if (!is_listed && impact_islands_[root_of(a, b)].is_open) open_blocks_.push_back(m);
  });
}

ContactSolver::ImpactIsland& ContactSolver::impact_island(const Block& block, size_t lane) {
  const uint32_t a = block.a[lane], b = block.b[lane];
  return impact_islands_[impact_sets_.find(a < moving_ ? a : b)];
}

void ContactSolver::ImpactIsland::choose_step() {
  // Below that the change is rounding.
  constexpr double kRounding = 16 * std::numeric_limits<T>::epsilon();
  is_open = is_open && dd > kRounding * noise;
  if (!is_open) return;
  s = d / dd;
  const double determinant = dd * ee - de * de;
  if (determinant > 1e-6 * dd * ee) {
    s = (d * ee - e * de) / determinant;
    t = (e * dd - d * de) / determinant;
  }
}

// Impulses have changed the velocities of bodies. A point that now approaches collides in the next
// round if it arrives within the step; if not, it keeps its speed until then. In the last round
// nothing bounces any more, and all pass impulses on.
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
  const Gathered g = gather(block, motions_);
  const Weights<T, Block> weights(block);
  const Lanes3<T> between = load3<T>(block.between);
  const L zero(T{0}), one(T{1}), h(static_cast<T>(settings.step_s));
  const L restitution = L::load(block.restitution.data());
  const L hard = L(static_cast<T>(kContactMargin / kResolution)) * L::load(block.slop.data());
  const L rounding = L(static_cast<T>(kRounding / settings.step_s)) * L::load(block.slop.data());
  const L substep(static_cast<T>(settings.step_s / settings.substeps));
  const auto may_bounce = hn::Or(min(weights.mass_a, weights.mass_b) > zero,
                                 hn::Not(L::load(block.bounced.data()) > zero));
  const auto is_free = hn::Not(L::load(block.passes.data()) > zero);
  const Lanes3<T> fall = fall_between(weights);
  L impact = zero;
  for (uint32_t p = block.first_point; p < block.first_point + block.points; ++p) {
    const Lanes3<T> n = load3<T>(points_[p].normal), arm_a = load3<T>(points_[p].arm);
    const Lanes3<T> of_a = g.velocity_a + cross(g.spin_a, arm_a);
    const Lanes3<T> of_b = g.velocity_b + cross(g.spin_b, arm_a + between);
    const L closing = dot(n, of_a - of_b);
    const L fastest = sqrt(max(dot(of_a, of_a), dot(of_b, of_b)));
    PointStart& start = starts_[p];
    const L distance = L::load(start.distance.data()) + moved_along(block, n, arm_a);
    const L at_end = distance - closing * h + dot(n, fall);
    // When they touch, and how fast then; as NarrowPhase::bounce().
    const L falls = (L(T{2}) * L(per_step_) * L(per_step_)) * dot(n, fall);  // m/s^2
    const L gap = max(distance, zero);
    const L there = sqrt(max(closing * closing - L(T{2}) * falls * gap, zero)) + closing;
    const auto arrives = there > zero;
    const L impact_s = min(select(arrives, L(T{2}) * gap / select(arrives, there, one), zero), h);
    const L speed = closing - impact_s * falls;
    // The sweeps have left a share of the speeds undone; that is no impact.
    const L undone = max(L(static_cast<T>(kSameImpulse)) * fastest, rounding);
    const auto comes = hn::And(L::load(points_[p].mass_along.data()) > zero, closing > undone);
    const auto outlives = hn::And(comes, restitution * closing > L(least_impact_));
    const auto misses = at_end > L(static_cast<T>(kAsGood)) * closing * h;
    const auto collides =
        hn::And(hn::AndNot(misses, hn::Or(outlives, hn::And(comes, closing * h > hard))), is_free);
    impact = select(collides, one, impact);
    // Off what does not move it bounces once in a step: where it stands friction would feed it.
    L bounce = select(hn::And(hn::And(collides, outlives), may_bounce),
                      restitution * speed - impact_s * falls, zero);
    if (is_last) bounce = zero;
    select(bounce > zero, bounce, approach(start, n, fall)).store(start.parting.data());
    select(bounce > zero, impact_s, zero).store(start.impact.data());
    const auto later =
        hn::And(comes, hn::Or(hn::And(outlives, misses), hn::AndNot(collides, closing * h > hard)));
    select(later, substep * speed, zero).store(start.allowance.data());
  }
  if (is_last) std::ranges::fill(block.passes, T{1});
  impact.store(block.impact.data());
  block.has_impacts = std::ranges::any_of(block.impact, [](T lane) { return lane > 0; });
}

}  // namespace pilesim::exact
