#include "simulate/exact/contact_solver.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>

#include "core/parallel_for.h"
#include "simulate/exact/contact_lanes.h"
#include "simulate/exact/exact_constants.h"

namespace pilesim::exact {

using namespace exact_constants;

namespace {

constexpr size_t kGrain = 16;
// To go over fewer one thread is as fast.
constexpr size_t kLeastContacts = 300;
constexpr size_t kBodyGrain = 128;
// m: what is as far does not touch.
template <typename T>
constexpr T kFar = static_cast<T>(1e15);
// m: so that lanes without a contact, whose extent is nothing, divide by something.
template <typename T>
constexpr T kLeast = static_cast<T>(1e-30);

// For lanes that are empty.
Contact no_contact() {
  Contact contact;
  contact.arm_a = contact.arm_b = contact.normal = Vec3f::Zero();
  contact.distance_m = 0;
  return contact;
}
const Contact kNoContact = no_contact();
// fill_points() and store() take the numbers of a contact as they lie in it.
static_assert(offsetof(Contact, normal) == 6 * sizeof(float) &&
              offsetof(Contact, distance_m) == 9 * sizeof(float) &&
              offsetof(Contact, normal_force_n) == 10 * sizeof(float) &&
              offsetof(Contact, friction_n) == 11 * sizeof(float));

// The turn (x, y, z, w) of `r`, less `r`; for round sides along the tangent only.
template <typename T>
HWY_INLINE Lanes3<T> turned_by(const Lanes3<T>& q, Lanes<T> w, Lanes<T> edged, const Lanes3<T>& r) {
  const Lanes3<T> t = cross(q, r);
  const Lanes3<T> t2 = {t.x + t.x, t.y + t.y, t.z + t.z};
  return add_scaled(w * t2, edged, cross(q, t2));
}

}  // namespace

// Inertia and mass of its bodies.
void ContactSolver::gather_weights(Block& block) const {
  const auto take = [&](const std::array<uint32_t, kLanes>& bodies, std::array<Row, 6>& inertia,
                        Row& mass) {
    std::array<const T*, kLanes> rows;
    std::array<Lanes<T>, 8> r;
    for (size_t i = 0; i < kLanes; ++i) rows[i] = inverse_[bodies[i]].v.data();
    gather8(rows.data(), r);
    for (size_t k = 0; k < 6; ++k) r[k].store(inertia[k].data());
    r[6].store(mass.data());
  };
  take(block.a, block.inertia_a, block.inverse_mass_a);
  take(block.b, block.inertia_b, block.inverse_mass_b);
}

void ContactSolver::fill(const SolverSettings& settings, std::span<const ContactRange> contacts,
                         size_t bodies) {
  const double substep_s = settings.step_s / settings.substeps;
  const double gravity = settings.gravity.norm();
  const auto nobody = static_cast<uint32_t>(bodies);
  const Softness springy = softness(kContactRate / substep_s, kContactDamping, substep_s);
  const Softness rigid{0, 1, 0};
  parallel_for(blocks_.size(), kGrain, [&](size_t begin, size_t end) {
    for (size_t m = begin; m < end; ++m) {
      Block& block = blocks_[m];
      LaneContacts lanes;
      for (size_t i = 0; i < kLanes; ++i) {
        const uint32_t source = order_[m * kLanes + i];
        if (source == kNone) {
          block.a[i] = block.b[i] = nobody;
          continue;
        }
        const ContactRange& range = contacts[source];
        block.a[i] = range.a;
        block.b[i] = range.b;
        lanes.first[i] = range.contacts;
        lanes.count[i] = range.count;
        block.friction[i] = static_cast<T>(range.friction);
        block.restitution[i] = static_cast<T>(range.restitution);
        block.slop[i] = static_cast<T>(range.slop_m);
        block.edged[i] = range.contacts->is_round ? T{0} : T{1};
        const Softness& soft = range.is_joined ? rigid : springy;
        block.rate[i] = static_cast<T>(soft.rate);
        block.mass_scale[i] = static_cast<T>(soft.mass_scale);
        block.force_scale[i] = static_cast<T>(soft.force_scale);
        block.impact[i] = range.collides ? T{1} : T{0};
        block.has_impacts = block.has_impacts || range.collides;
      }
      gather_weights(block);
      const Row load_n = fill_points(block, lanes, static_cast<T>(substep_s), settings.substeps);
      for (size_t i = 0; i < kLanes; ++i) {
        if (lanes.count[i] == 0) continue;
        const T lighter = std::max(block.inverse_mass_a[i], block.inverse_mass_b[i]);
        const bool is_loaded = gravity > 0 && lighter * load_n[i] > kSupport * gravity;
        block.passes[i] = is_loaded || block.restitution[i] == 0 ? T{1} : T{0};
      }
    }
  });
}

// Fills the points of a block; returns the sums of normal forces of the step before, N.
ContactSolver::Row ContactSolver::fill_points(Block& block, const LaneContacts& lanes, T substep_s,
                                              int substeps) {
  using L = Lanes<T>;
  const Weights<T, Block> weights(block);
  const L zero(T{0}), one(T{1}), half(T{0.5}), h(substep_s);
  const L mass = weights.mass_a + weights.mass_b;
  // How deep the spring of a contact is pressed in, for an impulse on an inertia.
  const L least(kLeast<T>);
  const L give = L::load(block.force_scale.data()) /
                 max(L::load(block.mass_scale.data()) * L::load(block.rate.data()), least);
  const L slop = L::load(block.slop.data());
  const L most_loaded = slop * L(static_cast<T>(kLoaded / kResolution));
  const Lanes3<T> fall = fall_between(weights);
  L load_n = zero;
  for (uint32_t p = 0; p < block.points; ++p) {
    Point& point = points_[block.first_point + p];
    PointStart& start = starts_[block.first_point + p];
    std::array<const T*, kLanes> rows, more_rows;
    Row bounces, hits, impacts;
    for (size_t i = 0; i < kLanes; ++i) {
      const Contact& contact = p < lanes.count[i] ? lanes.first[i][p] : kNoContact;
      rows[i] = contact.arm_a.data();
      more_rows[i] = rows[i] + kLanes;
      bounces[i] = contact.bounce;
      hits[i] = contact.hits ? T{1} : T{0};
      impacts[i] = contact.impact_s;
    }
    // Numbers of a contact as they lie in it.
    std::array<L, 8> r, more;
    gather8(rows.data(), r);
    gather8(more_rows.data(), more);
    const Lanes3<T> arm_a = {r[0], r[1], r[2]}, n = {r[6], r[7], more[0]};
    if (p == 0) store3<T>(Lanes3<T>{r[3], r[4], r[5]} - arm_a, block.between);
    const Lanes3<T> arm_b = arm_a + load3<T>(block.between);
    const L distance = more[1], force = more[2], push = h * force;
    load_n = load_n + force;
    store3<T>(n, point.normal);
    store3<T>(arm_a, point.arm);
    store3<T>(h * Lanes3<T>{more[3], more[4], more[5]}, point.friction);
    push.store(point.push.data());
    distance.store(point.now.data());
    distance.store(start.distance.data());
    start.impact = impacts;
    const L bounce = L::load(bounces.data());
    // A point that collides in a step to come keeps its speed: the relaxations after the last
    // motion look a substep ahead, and took a share of it.
    const auto arrives = hn::AndNot(bounce > zero, L::load(hits.data()) > zero);
    select(arrives, max(zero, distance) / L(static_cast<T>(substeps)), h * max(zero, zero - bounce))
        .store(start.allowance.data());
    select(bounce > zero, bounce, approach(start, n, fall)).store(start.parting.data());

    const auto answer = [&](const Lanes3<T>& u, const Lanes3<T>& v) {
      return dot(cross(arm_a, u), weights.inertia_a * cross(arm_a, v)) +
             dot(cross(arm_b, u), weights.inertia_b * cross(arm_b, v));
    };
    const Lanes3<T> answered = add_scaled(cross(weights.inertia_a * cross(arm_a, n), arm_a) +
                                              cross(weights.inertia_b * cross(arm_b, n), arm_b),
                                          mass, n);
    store3<T>(answered, point.answer);
    const L along = dot(n, answered);
    const auto there = along > zero;
    select(there, one / select(there, along, one), zero).store(point.mass_along.data());
    max(slop, min(give * push * along, most_loaded)).store(point.slop.data());
    // Across: by the direction that is easiest to move, so that friction never overshoots.
    const auto flat = L::of(hn::Abs(n.x.v)) > L(static_cast<T>(0.6));
    const Lanes3<T> other = {select(flat, zero, one), select(flat, one, zero), zero};
    Lanes3<T> u = cross(n, other);
    const L length2 = dot(u, u);
    const auto real = length2 > zero;
    u = (one / sqrt(select(real, length2, one))) * u;
    const Lanes3<T> v = cross(n, u);
    const L uu = answer(u, u), vv = answer(v, v), uv = answer(u, v);
    const L difference = half * (uu - vv);
    const L easiest = mass + half * (uu + vv) + sqrt(mul_add(difference, difference, uv * uv));
    const auto movable = easiest > zero;
    select(movable, one / select(movable, easiest, one), zero).store(point.mass_across.data());
  }
  Row sum;
  load_n.store(sum.data());
  return sum;
}

// Once fill() has filled blocks and points.
void ContactSolver::fill_surfaces(std::span<const ContactRange> contacts) {
  running_.assign(points_.size(), {});
  parallel_for(blocks_.size(), kGrain, [&](size_t begin, size_t end) {
    for (size_t m = begin; m < end; ++m) {
      Block& block = blocks_[m];
      for (size_t i = 0; i < kLanes; ++i) {
        const uint32_t source = order_[m * kLanes + i];
        if (source == kNone) continue;
        const ContactRange& range = contacts[source];
        const auto spin_of = [&](uint32_t body, const SurfaceVelocity* surface) {
          if (body < moving_) return Vec3(Vec3::Zero());
          return Vec3(spin(body) + (surface != nullptr ? surface->angular : Vec3::Zero()));
        };
        const Vec3 turning =
            -(spin_of(range.a, range.surface_a) + spin_of(range.b, range.surface_b));
        if (range.surface_a == nullptr && range.surface_b == nullptr && turning.isZero(0)) continue;
        block.has_surfaces = true;
        for (uint32_t p = 0; p < range.count; ++p) {
          const Contact& contact = range.contacts[p];
          const Vec3 normal = contact.normal.cast<double>();
          Vec3 velocity = Vec3::Zero(), turn = Vec3::Zero();
          const auto add = [&](const SurfaceVelocity* surface, const Vec3f& arm, double sign) {
            if (surface == nullptr) return;
            velocity += sign * (surface->linear + surface->angular.cross(arm.cast<double>()));
            turn += sign * surface->angular;
          };
          add(range.surface_a, contact.arm_a, -1);
          add(range.surface_b, contact.arm_b, 1);
          velocity -= normal.dot(velocity) * normal;
          Running& running = running_[block.first_point + p];
          for (size_t k = 0; k < 3; ++k) {
            const auto e = static_cast<Eigen::Index>(k);
            running.velocity[k][i] = running.start[k][i] = static_cast<T>(velocity[e]);
            running.spin[k][i] = static_cast<T>(turn[e]);
            running.turning[k][i] = static_cast<T>(turning[e]);
          }
        }
      }
    }
  });
}

// On a surface that turns each place has another speed: without this what lies on a turntable would
// go straight on in each step, and outward.
void ContactSolver::run_on(const Block& block) {
  const auto displacement = [&](const std::array<uint32_t, kLanes>& bodies) {
    Rows rows;
    for (size_t i = 0; i < kLanes; ++i) {
      for (size_t k = 0; k < 3; ++k) rows[k][i] = shifts_[bodies[i]].v[k];
    }
    return load3<T>(rows);
  };
  const Lanes3<T> moved = displacement(block.b) - displacement(block.a);
  for (uint32_t p = block.first_point; p < block.first_point + block.points; ++p) {
    Running& running = running_[p];
    const Lanes3<T> n = load3<T>(points_[p].normal);
    const Lanes3<T> gained = cross(load3<T>(running.turning), moved);
    store3<T>(load3<T>(running.start) + sub_scaled(gained, dot(n, gained), n), running.velocity);
  }
}

// Applies the impulses of the last step: warm starting.
void ContactSolver::apply_forces(Block& block) {
  Gathered g = gather(block, motions_);
  const Weights<T, Block> weights(block);
  const Lanes3<T> between = load3<T>(block.between);
  for (uint32_t p = block.first_point; p < block.first_point + block.points; ++p) {
    const Point& point = points_[p];
    const Lanes3<T> arm = load3<T>(point.arm);
    const Lanes3<T> push = add_scaled(load3<T>(point.friction), Lanes<T>::load(point.push.data()),
                                      load3<T>(point.normal));
    weights.apply(push, arm, arm + between, g);
  }
  scatter(block, g, motions_);
  if (block.holds_turning) apply_torques(block);
}

// The impulses of the partner's contacts in the step, found in turns with those here, for the step
// as a whole and without moving anything. The substeps then have it as a force that is always
// there: so the partner needs none of its own.
void ContactSolver::take_turns(const SolverSettings& settings,
                               const std::vector<SolverBody>& bodies,
                               std::span<SolverJoint> joints) {
  const std::vector<Motion> motions = motions_;
  const std::vector<Point> points = points_;
  const std::vector<Torque> torques = torques_;
  const std::vector<SolverJoint> former(joints.begin(), joints.end());
  const auto step = static_cast<T>(settings.step_s);
  for (size_t i = 0; i < moving_; ++i) {
    for (size_t k = 0; k < 3; ++k) {
      motions_[i].v[k] += step * static_cast<T>(settings.gravity[static_cast<Eigen::Index>(k)]);
    }
  }
  const auto scale = [&](Row& row) {
    for (T& value : row) value *= static_cast<T>(settings.substeps);
  };
  for (Point& point : points_) {
    scale(point.push);
    for (Row& row : point.friction) scale(row);
  }
  for (Torque& torque : torques_) {
    for (Row& row : torque.given) scale(row);
  }
  for_blocks([&](size_t, Block& block) { apply_forces(block); });
  for (SolverJoint& joint : joints) {
    place(joint, bodies);
    give(joint, settings.step_s * joint.force_n, settings.step_s * joint.torque_on_b_nm());
  }
  for (int i = 0; i < settings.shared_sweeps; ++i) {
    settings.partner(i);
    hold(joints, step, false);
    for_blocks([&](size_t, Block& block) { sweep<false>(block, 1 / step); });
  }
  motions_ = motions;
  points_ = points;
  torques_ = torques;
  std::ranges::copy(former, joints.begin());
}

// How far apart points are where bodies have come to.
HWY_INLINE void ContactSolver::measure(Block& block, bool is_last) {
  using L = Lanes<T>;
  const auto [a, b] = gather_shifts(block);
  const Lanes3<T> displacement = {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
  const Lanes3<T> turn_a = {a[3], a[4], a[5]}, turn_b = {b[3], b[4], b[5]};
  const Lanes3<T> between = load3<T>(block.between);
  const L edged = L::load(block.edged.data()), zero(T{0}), far(kFar<T>);
  // Corners of what has turned far are elsewhere: the next step sees them.
  const L least_turn = min(max(a[6], zero - a[6]), max(b[6], zero - b[6]));
  const auto gone = hn::And(edged > zero, L(static_cast<T>(kLeastCosine)) > least_turn);
  for (uint32_t p = block.first_point; p < block.first_point + block.points; ++p) {
    Point& point = points_[p];
    const Lanes3<T> arm_a = load3<T>(point.arm), arm_b = arm_a + between;
    const Lanes3<T> moved = displacement + (turned_by(turn_b, b[6], edged, arm_b) -
                                            turned_by(turn_a, a[6], edged, arm_a));
    const PointStart& start = starts_[p];
    L distance = L::load(start.distance.data()) + dot(load3<T>(point.normal), moved);
    if (is_last) distance = distance + L::load(start.allowance.data());
    select(gone, far, distance).store(point.now.data());
  }
}

template <bool kSoft>
HWY_INLINE void ContactSolver::sweep(Block& block, T inverse_step) {
  using L = Lanes<T>;
  Gathered g = gather(block, motions_);
  const Weights<T, Block> weights(block);
  const Lanes3<T> between = load3<T>(block.between);
  const L zero(T{0}), one(T{1}), rate_ahead(inverse_step);
  const L slow(slow_rate_), fastest(fastest_);
  const L friction = L::load(block.friction.data());
  const L extent =
      max(L::load(block.slop.data()), L(kLeast<T>)) * L(static_cast<T>(1 / kResolution));
  const L deeper = fastest * L(static_cast<T>(kDeeper)) / extent;
  const L soft_rate = L::load(block.rate.data());
  const L mass_scale = L::load(block.mass_scale.data());
  const L force_scale = L::load(block.force_scale.data());
  for (uint32_t p = block.first_point; p < block.first_point + block.points; ++p) {
    Point& point = points_[p];
    const Lanes3<T> n = load3<T>(point.normal), arm_a = load3<T>(point.arm);
    const Lanes3<T> arm_b = arm_a + between;
    const L distance = L::load(point.now.data());
    const L mass = L::load(point.mass_along.data());
    const L old_push = L::load(point.push.data());
    // Ahead of the surface: so fast that it is reached when the substep ends. Behind it: back,
    // softly.
    const auto ahead = distance > zero;
    L bias, scale = one, give = zero;
    if constexpr (kSoft) {
      const L slop = L::load(point.slop.data());
      const L slowly = max(slow * (distance + slop),
                           mul_add(deeper, max(distance, zero - extent), zero - fastest));
      const L undone = max(soft_rate * distance, neg_mul_add(soft_rate, slop, slowly));
      bias = select(ahead, distance * rate_ahead, undone);
      scale = select(ahead, one, mass_scale);
      give = select(ahead, zero, force_scale);
    } else {
      bias = select(ahead, distance * rate_ahead, zero);
    }
    Lanes3<T> dv = relative<T>(g, arm_a, arm_b);
    L push = neg_mul_add(mass * scale, dot(n, dv) + bias, old_push);
    if constexpr (kSoft) push = neg_mul_add(give, old_push, push);
    push = max(push, zero);
    push.store(point.push.data());
    const L pushed = push - old_push;
    dv = add_scaled(dv, pushed, load3<T>(point.answer));
    if (block.has_surfaces) dv = dv + load3<T>(running_[p].velocity);

    const Lanes3<T> old_friction = load3<T>(point.friction);
    const Lanes3<T> held =
        hold_back(dv, n, L::load(point.mass_across.data()), friction * push, old_friction);
    store3<T>(held, point.friction);
    weights.apply(add_scaled(held - old_friction, pushed, n), arm_a, arm_b, g);
  }
  scatter(block, g, motions_);
  if (block.holds_turning) hold_turning(block, false);
}

void ContactSolver::store(std::span<const ContactRange> contacts, double substep_s) {
  using L = Lanes<T>;
  const L per_second(static_cast<T>(1 / substep_s));
  parallel_for(blocks_.size(), kGrain, [&](size_t begin, size_t end) {
    for (size_t m = begin; m < end; ++m) {
      const Block& block = blocks_[m];
      for (uint32_t p = 0; p < block.points; ++p) {
        const Point& point = points_[block.first_point + p];
        const Lanes3<T> friction = per_second * load3<T>(point.friction);
        // The force along the normal and that across it, as they lie in a contact.
        std::array<L, 8> forces;
        forces.fill(L(T{0}));
        forces[0] = per_second * L::load(point.push.data());
        forces[1] = friction.x;
        forces[2] = friction.y;
        forces[3] = friction.z;
        transpose(forces);
        for (size_t i = 0; i < kLanes; ++i) {
          const uint32_t source = order_[m * kLanes + i];
          if (source == kNone || p >= contacts[source].count) continue;
          const hn::Half<L::Tag> four;
          hn::StoreU(hn::LowerHalf(four, forces[i].v), four,
                     &contacts[source].contacts[p].normal_force_n);
        }
      }
    }
  });
}

void ContactSolver::make_substeps(const SolverSettings& settings, std::vector<SolverBody>& bodies,
                                  std::span<SolverJoint> joints) {
  const double substep_s = settings.step_s / settings.substeps;
  const auto h = static_cast<T>(substep_s);
  const T per_substep = 1 / h;
  solve_impacts(settings, joints);
  for (int substep = 0; substep < settings.substeps; ++substep) {
    parallel_for(moving_, kBodyGrain,
                 [&](size_t begin, size_t end) { pull(begin, end, settings, h, substep == 0); });
    for (const SolverPath& path : settings.paths) {
      const auto now = static_cast<size_t>(substep);
      set_velocity(path.body, path.velocity[now], path.spin[now]);
    }
    if (substep == 0) for_blocks([&](size_t, Block& block) { apply_forces(block); });
    for (SolverJoint& joint : joints) {
      place(joint, bodies);
      give_again(joint, substep_s, substep == 0);
    }
    hold(joints, h, true);
    for_blocks([&](size_t, Block& block) { sweep<true>(block, per_substep); });
    parallel_for(bodies.size(), kBodyGrain,
                 [&](size_t begin, size_t end) { move(bodies, begin, end, settings.gravity, h); });
    for (SolverJoint& joint : joints) place(joint, bodies);
    for (int i = 0; i < kRelaxations; ++i) {
      hold(joints, h, false);
      for_blocks([&](size_t, Block& block) {
        if (i == 0) measure(block, substep + 1 == settings.substeps);
        if (i == 0 && block.has_surfaces) run_on(block);
        sweep<false>(block, per_substep);
      });
    }
    for (SolverJoint& joint : joints) joint.push_ns += substep_s * joint.force_n;
  }
}

// Bodies and contacts as sweeps have them.
void ContactSolver::prepare(const SolverSettings& settings, const std::vector<SolverBody>& bodies,
                            std::span<const ContactRange> contacts) {
  motions_.resize(bodies.size() + 1);  // the last for empty lanes
  inverse_.resize(bodies.size() + 1);
  motions_.back() = {};
  inverse_.back() = {};
  shifts_.resize(bodies.size() + 1);
  pulled_.assign(moving_, {});
  given_.assign(moving_, {});
  turned_.assign(moving_, {});
  Shift none{};
  none.v[6] = 1;
  shifts_.back() = none;
  parallel_for(bodies.size(), kBodyGrain, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      const SolverBody& body = bodies[i];
      const Mat3& inertia = body.inverse_inertia;
      const std::array<double, 8> inverse = {
          inertia(0, 0), inertia(1, 1), inertia(2, 2),     inertia(0, 1),
          inertia(0, 2), inertia(1, 2), body.inverse_mass, 0};
      Motion& motion = motions_[i];
      for (size_t k = 0; k < 3; ++k) {
        motion.v[k] = static_cast<T>(body.velocity[static_cast<Eigen::Index>(k)]);
        motion.v[k + 3] = static_cast<T>(body.spin[static_cast<Eigen::Index>(k)]);
      }
      motion.v[6] = motion.v[7] = 0;
      for (size_t k = 0; k < 8; ++k) inverse_[i].v[k] = static_cast<T>(inverse[k]);
      for (size_t k = 0; k < 3 && i < moving_; ++k) {
        turned_[i].v[k + 3] = static_cast<T>(body.turned_spin[static_cast<Eigen::Index>(k)]);
      }
      shifts_[i] = none;
      shifts_[i].v[7] = static_cast<T>(body.share);
    }
  });
  arrange(contacts);
  per_step_ = static_cast<T>(1 / settings.step_s);
  fall_ = (settings.gravity * settings.step_s * settings.step_s / 2).cast<T>();
  fill(settings, contacts, bodies.size());
  if (settings.has_surfaces) fill_surfaces(contacts);
  torques_.clear();
  if (settings.has_torques) fill_torques(contacts, settings.step_s / settings.substeps);
}

// Results of the sweeps.
void ContactSolver::take_over(const SolverSettings& settings, std::vector<SolverBody>& bodies,
                              std::span<const ContactRange> contacts) {
  parallel_for(bodies.size(), kBodyGrain, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      const auto place = static_cast<uint32_t>(i);
      bodies[i].velocity = velocity(place);
      bodies[i].spin = spin(place);
      const Shift& shift = shifts_[i];
      bodies[i].displacement = Vec3(shift.v[0], shift.v[1], shift.v[2]);
      bodies[i].turn = Quat(shift.v[6], shift.v[3], shift.v[4], shift.v[5]).normalized();
    }
  });
  const double substep_s = settings.step_s / settings.substeps;
  store(contacts, substep_s);
  if (!torques_.empty()) store_torques(contacts, substep_s);
}

void ContactSolver::solve(const SolverSettings& settings, std::vector<SolverBody>& bodies,
                          size_t moving, std::span<const ContactRange> contacts,
                          std::span<SolverJoint> joints) {
  moving_ = moving;
  is_small_ = contacts.size() < kLeastContacts;
  slow_rate_ = static_cast<T>(1 / settings.push_time_s);
  fastest_ = static_cast<T>(settings.push_speed);
  prepare(settings, bodies, contacts);
  if (settings.partner) take_turns(settings, bodies, joints);
  make_substeps(settings, bodies, joints);
  take_over(settings, bodies, contacts);
}

}  // namespace pilesim::exact
