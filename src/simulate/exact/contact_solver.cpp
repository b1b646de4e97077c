#include "simulate/exact/contact_solver.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

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
  const Softness moving = softness(kContactRate / substep_s, kContactDamping, substep_s);
  const Softness fixed = softness(2 * kContactRate / substep_s, kContactDamping, substep_s);
  const Softness rigid{0, 1, 0};
  parallel_for(blocks_.size(), kGrain, [&](size_t begin, size_t end) {
    for (size_t m = begin; m < end; ++m) {
      Block& block = blocks_[m];
      block.has_impacts = block.has_surfaces = false;
      block.impact = block.bounced = block.passes = block.reached = {};
      std::span<Point> points(points_.data() + block.first_point, block.points);
      const std::span<PointStart> starts(starts_.data() + block.first_point, block.points);
      std::memset(static_cast<void*>(points.data()), 0, points.size_bytes());
      std::memset(static_cast<void*>(starts.data()), 0, starts.size_bytes());
      for (size_t i = 0; i < kLanes; ++i) {
        const uint32_t source = order_[m * kLanes + i];
        if (source == kNone) {
          block.a[i] = block.b[i] = nobody;
          continue;
        }
        const ContactRange& range = contacts[source];
        block.a[i] = range.a;
        block.b[i] = range.b;
        const Contact* contact = range.contacts;
        for (size_t k = 0; k < 3; ++k) {
          const auto e = static_cast<Eigen::Index>(k);
          block.between[k][i] = static_cast<T>(contact->arm_b[e] - contact->arm_a[e]);
        }
        block.friction[i] = static_cast<T>(range.friction);
        block.restitution[i] = static_cast<T>(range.restitution);
        block.slop[i] = static_cast<T>(range.slop_m);
        block.edged[i] = contact->is_round ? T{0} : T{1};
        const Softness& soft = range.is_joined                          ? rigid
                               : range.a < moving_ && range.b < moving_ ? moving
                                                                        : fixed;
        block.rate[i] = static_cast<T>(soft.rate);
        block.mass_scale[i] = static_cast<T>(soft.mass_scale);
        block.force_scale[i] = static_cast<T>(soft.force_scale);
        float load_n = 0;
        for (uint32_t p = 0; p < range.count; ++p, ++contact) {
          Point& point = points[p];
          load_n += contact->normal_force_n;
          for (size_t k = 0; k < 3; ++k) {
            const auto e = static_cast<Eigen::Index>(k);
            point.normal[k][i] = contact->normal[e];
            point.arm[k][i] = contact->arm_a[e];
            point.friction[k][i] = static_cast<T>(contact->friction_n[e] * substep_s);
          }
          starts[p].distance[i] = point.now[i] = static_cast<T>(contact->distance_m);
          // A point that collides in a step to come keeps its speed: the relaxations after the last
          // motion look a substep ahead, and took a share of it.
          starts[p].allowance[i] = static_cast<T>(substep_s * std::max(0.0F, -contact->bounce));
          if (contact->hits && !(contact->bounce > 0)) {
            starts[p].allowance[i] =
                std::max(T{0}, contact->distance_m) / static_cast<T>(settings.substeps);
          }
          point.push[i] = static_cast<T>(contact->normal_force_n * substep_s);
          starts[p].parting[i] = std::max(0.0F, contact->bounce);
          if (contact->hits || contact->bounce > 0) block.impact[i] = 1;
        }
        block.has_impacts = block.has_impacts || block.impact[i] > 0;
        const T lighter = std::max(inverse_[range.a].v[6], inverse_[range.b].v[6]);
        const bool is_loaded = gravity > 0 && lighter * load_n > kSupport * gravity;
        block.passes[i] = is_loaded || range.restitution == 0 ? T{1} : T{0};
      }
      gather_weights(block);
      const Weights<T, Block> weights(block);
      const Lanes3<T> between = load3<T>(block.between);
      const Lanes<T> zero(T{0}), one(T{1}), half(T{0.5});
      const Lanes<T> mass = weights.mass_a + weights.mass_b;
      // How deep the spring of a contact is pressed in, for an impulse on an inertia.
      const Lanes<T> least(kLeast<T>);
      const Lanes<T> give =
          Lanes<T>::load(block.force_scale.data()) /
          max(Lanes<T>::load(block.mass_scale.data()) * Lanes<T>::load(block.rate.data()), least);
      const Lanes<T> slop = Lanes<T>::load(block.slop.data());
      const Lanes<T> most_loaded = slop * Lanes<T>(static_cast<T>(kLoaded / kResolution));
      const Lanes3<T> fall = fall_between(weights);
      for (size_t p = 0; p < points.size(); ++p) {
        Point& point = points[p];
        const Lanes3<T> n = load3<T>(point.normal), arm_a = load3<T>(point.arm);
        const Lanes3<T> arm_b = arm_a + between;
        const Lanes<T> bounce = Lanes<T>::load(starts[p].parting.data());
        select(bounce > zero, bounce, approach(starts[p], n, fall)).store(starts[p].parting.data());
        const auto answer = [&](const Lanes3<T>& u, const Lanes3<T>& v) {
          return dot(cross(arm_a, u), weights.inertia_a * cross(arm_a, v)) +
                 dot(cross(arm_b, u), weights.inertia_b * cross(arm_b, v));
        };
        const Lanes3<T> answered = add_scaled(cross(weights.inertia_a * cross(arm_a, n), arm_a) +
                                                  cross(weights.inertia_b * cross(arm_b, n), arm_b),
                                              mass, n);
        store3<T>(answered, point.answer);
        const Lanes<T> along = dot(n, answered);
        const auto there = along > zero;
        select(there, one / select(there, along, one), zero).store(point.mass_along.data());
        const Lanes<T> load = give * Lanes<T>::load(point.push.data()) * along;
        max(slop, min(load, most_loaded)).store(point.slop.data());
        // Across: by the direction that is easiest to move, so that friction never overshoots.
        const auto flat = Lanes<T>::of(hn::Abs(n.x.v)) > Lanes<T>(static_cast<T>(0.6));
        const Lanes3<T> other = {select(flat, zero, one), select(flat, one, zero), zero};
        Lanes3<T> u = cross(n, other);
        const Lanes<T> length2 = dot(u, u);
        const auto real = length2 > zero;
        u = (one / sqrt(select(real, length2, one))) * u;
        const Lanes3<T> v = cross(n, u);
        const Lanes<T> uu = answer(u, u), vv = answer(v, v), uv = answer(u, v);
        const Lanes<T> difference = half * (uu - vv);
        const Lanes<T> easiest =
            mass + half * (uu + vv) + sqrt(mul_add(difference, difference, uv * uv));
        const auto movable = easiest > zero;
        select(movable, one / select(movable, easiest, one), zero).store(point.mass_across.data());
      }
    }
  });
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
  std::array<const T*, kLanes> rows;
  std::array<L, 8> a, b;
  for (size_t i = 0; i < kLanes; ++i) rows[i] = shifts_[block.a[i]].v.data();
  gather8(rows.data(), a);
  for (size_t i = 0; i < kLanes; ++i) rows[i] = shifts_[block.b[i]].v.data();
  gather8(rows.data(), b);
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
  const L deeper = fastest * L(static_cast<T>(kDeeper * kResolution)) /
                   max(L::load(block.slop.data()), L(kLeast<T>));
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
      const L slowly = max(slow * (distance + slop), mul_add(deeper, distance, zero - fastest));
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
  const auto per_second = static_cast<T>(1 / substep_s);
  parallel_for(blocks_.size(), kGrain, [&](size_t begin, size_t end) {
    for (size_t m = begin; m < end; ++m) {
      const Block& block = blocks_[m];
      for (size_t i = 0; i < kLanes; ++i) {
        const uint32_t source = order_[m * kLanes + i];
        if (source == kNone) continue;
        const ContactRange& range = contacts[source];
        for (uint32_t p = 0; p < range.count; ++p) {
          const Point& point = points_[block.first_point + p];
          Contact& contact = range.contacts[p];
          contact.normal_force_n = static_cast<float>(point.push[i] * per_second);
          for (size_t k = 0; k < 3; ++k) {
            contact.friction_n[static_cast<Eigen::Index>(k)] =
                static_cast<float>(point.friction[k][i] * per_second);
          }
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
  solve_impacts(settings);
  for (int substep = 0; substep < settings.substeps; ++substep) {
    parallel_for(moving_, kBodyGrain, [&](size_t begin, size_t end) {
      for (size_t i = begin; i < end; ++i) pull(i, settings, h, substep == 0);
    });
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
    parallel_for(bodies.size(), kBodyGrain, [&](size_t begin, size_t end) {
      for (size_t i = begin; i < end; ++i) move(bodies[i], i, settings.gravity, h);
    });
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
      shifts_[i] = none;
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
