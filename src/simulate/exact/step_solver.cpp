#include "simulate/exact/step_solver.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <iterator>
#include <limits>

#include "core/parallel_for.h"
#include "model/kinematic_motion.h"
#include "simulate/exact/exact_constants.h"
#include "simulate/free_rotation.h"

namespace pilesim::exact {

using namespace exact_constants;

namespace {

constexpr size_t kGrain = 128;

SolverSettings settings_of(const Scene& scene, const Model& model) {
  SolverSettings settings{.push_time_s = kUsualPushTime,
                          .push_speed = kUsualPushSpeed,
                          .gravity = scene.gravity,
                          .shared_sweeps = scene.simulator.solver_iterations};
  const double gravity = scene.gravity.norm();
  const double least_radius = least_radius_m(model);
  if (gravity > 0 && std::isfinite(least_radius)) {
    settings.push_time_s = kPushTime * std::sqrt(least_radius / gravity);
    settings.push_speed = kPushSpeed * std::sqrt(least_radius * gravity);
  }
  return settings;
}

// A contact or a joint is a spring that swings at a share of the rate of substeps, so a force F on
// a mass m presses it in by F / (m w^2). The square of the rate, 1/s^2, that keeps this below
// `most_m`.
double rate2_of(double force_n, double inverse_mass, double most_m, double share_of_rate) {
  const double turn = 2 * kPi * share_of_rate;
  return force_n * inverse_mass / (most_m * turn * turn);
}

// Substeps for `step_s` at a rate of at least sqrt(rate2) 1/s: 4, 6, 8, 12, 16, 24, ...
int substeps_for(double step_s, double rate2) {
  const double needed = step_s * std::sqrt(rate2);
  int substeps = kLeastSubsteps;
  while (substeps < kMostSubsteps && substeps < kAlmost * needed) {
    const bool is_power = std::has_single_bit(static_cast<unsigned>(substeps));
    substeps += is_power ? substeps / 2 : substeps / 3;
  }
  return substeps;
}

bool carries_nothing(const Joint& joint) {
  return !joint.is_glue && joint.force_n.isZero(0) && joint.torque_nm.isZero(0);
}

}  // namespace

// Bodies that are solved with as many substeps, and with the partner or without it.
struct StepSolver::Group {
  int substeps;
  bool has_partner;
  std::vector<uint32_t> bodies;    // that move, in the order of `movers_`
  std::vector<uint32_t> touching;  // pairs
  std::vector<uint32_t> joints;
};

StepSolver::StepSolver(const Scene& scene, const Model& model,
                       std::span<const CollisionShape> shapes, EngineState& state,
                       const std::vector<uint32_t>& active)
    : shapes_(shapes),
      state_(state),
      bodies_(state.bodies),
      active_(active),
      resistance_(model),
      accuracy_(scene.accuracy),
      model_(model),
      settings_(settings_of(scene, model)),
      place_(model.bodies.size(), kNone) {
  settings_.has_torques = !resistance_.is_none();
  for (uint32_t i = 0; i < model.bodies.size(); ++i) {
    if (model.bodies[i].surface_velocity) running_.push_back(i);
  }
}

Vec3 StepSolver::velocity(uint32_t body) const { return solver_.velocity(place_[body]); }
Vec3 StepSolver::spin(uint32_t body) const { return solver_.spin(place_[body]); }

void StepSolver::change_velocity(uint32_t body, const Vec3& linear, const Vec3& angular) {
  if (linear.isZero(0) && angular.isZero(0)) return;
  is_touched_[body] = 1;
  solver_.change_velocity(place_[body], linear, angular);
}

void StepSolver::solve(double step_s, std::span<const uint32_t> touching,
                       std::span<const double> advanced_s, const Partner& partner) {
  settings_.step_s = step_s;
  list_bodies(touching, partner);
  if (movers_.empty()) return followed_.clear();
  turn_surfaces();
  find_loads(touching);
  broken_.clear();
  for (const Group& group : this->group(touching, partner)) {
    settings_.partner = group.has_partner ? partner.sweep : nullptr;
    solve(group, advanced_s);
  }
  followed_.clear();
  // Hinges, which have no id of their own, never break.
  std::ranges::sort(broken_);
  std::copy(std::ranges::lower_bound(broken_, Joint::kFirstOfModel), broken_.end(),
            std::back_inserter(state_.broken));
  std::erase_if(state_.joints,
                [&](const Joint& joint) { return std::ranges::binary_search(broken_, joint.id); });
}

void StepSolver::solve(const Group& group, std::span<const double> advanced_s) {
  settings_.substeps = group.substeps;
  body_at_ = group.bodies;
  moving_ = body_at_.size();
  for (uint32_t i = 0; i < moving_; ++i) place_[body_at_[i]] = i;
  make_bodies(advanced_s);
  list_contacts(group.touching);
  list_joints(group.joints);
  list_paths();
  settings_.has_surfaces =
      !running_.empty() ||
      std::any_of(solver_bodies_.begin() + static_cast<std::ptrdiff_t>(moving_),
                  solver_bodies_.end(),
                  [](const SolverBody& body) { return !body.spin.isZero(0); });
  solver_.solve(settings_, solver_bodies_, moving_, ranges_, solver_joints_);
  take_over_bodies();
  take_over_joints();
  for (size_t i = moving_; i < body_at_.size(); ++i) {
    if (body_at_[i] != kNone) place_[body_at_[i]] = kNone;
  }
}

// Those that something may push.
void StepSolver::list_bodies(std::span<const uint32_t> touching, const Partner& partner) {
  for (const uint32_t i : movers_) place_[i] = kNone;
  movers_.clear();
  is_touched_.assign(bodies_.size(), 0);
  for (const uint32_t t : touching)
    is_touched_[state_.pairs[t].a] = is_touched_[state_.pairs[t].b] = 1;
  for (const Joint& joint : state_.joints) {
    is_touched_[joint.a] = 1;
    if (joint.b != Joint::kWorld) is_touched_[joint.b] = 1;
  }
  for (const uint32_t i : active_) {
    const bool may_be_pushed = is_touched_[i] != 0 || std::ranges::binary_search(partner.bodies, i);
    if (may_be_pushed && bodies_[i].is_awake()) movers_.push_back(i);
  }
  order_.sort(movers_, [&](uint32_t i) -> const Vec3& { return bodies_[i].position; });
}

// From the forces of the step before follows how frequent substeps must be for a body: one rule for
// high stacks, large ratios of mass, and glue. Loads are averaged over the time in which a body
// falls through its own size: an impact is no load, and springs that are soft when they are pressed
// in and stiff when they push back would drive what rocks on them.
void StepSolver::find_loads(std::span<const uint32_t> touching) {
  loads_.resize(bodies_.size());
  for (const uint32_t i : movers_) loads_[i] = 0;
  const auto is_moved = [&](uint32_t i) { return i != kNone && bodies_[i].is_awake(); };
  const auto add = [&](uint32_t a, uint32_t b, double force_n, double share_of_rate, double give) {
    double inverse_mass = 0, extent = std::numeric_limits<double>::infinity();
    for (const uint32_t i : {a, b}) {
      if (!is_moved(i)) continue;
      inverse_mass += 1 / bodies_[i].mass_kg;
      extent = std::min(extent, shape_of(i).smallest_extent_m);
    }
    if (inverse_mass == 0) return;
    const double rate2 = rate2_of(force_n, inverse_mass, give * accuracy_ * extent, share_of_rate);
    for (const uint32_t i : {a, b}) {
      if (is_moved(i)) loads_[i] = std::max(loads_[i], rate2);
    }
  };
  for (const uint32_t t : touching) {
    const Pair& pair = state_.pairs[t];
    // Bodies that hook into each other press against each other from opposite sides; that carries
    // nothing.
    Vec3f net = Vec3f::Zero();
    float most_n = 0, sum_n = 0;
    for (const Contact& contact : state_.contacts_of(pair)) {
      net += contact.normal_force_n * contact.normal;
      sum_n += contact.normal_force_n;
      most_n = std::max(most_n, contact.normal_force_n);
    }
    const float force_n = sum_n > 0 ? most_n * net.norm() / sum_n : 0;
    if (force_n > 0) add(pair.a, pair.b, force_n, kContactRate, kGiveOfAccuracy);
  }
  const double gravity = settings_.gravity.norm();
  for (const uint32_t i : movers_) {
    Body& body = bodies_[i];
    const double time_s =
        gravity > 0 ? std::sqrt(shape_of(i).smallest_extent_m / gravity) : kUsualPushTime;
    body.load_rate2 -= std::expm1(-settings_.step_s / time_s) * (loads_[i] - body.load_rate2);
  }
  for (const uint32_t i : movers_) loads_[i] = 0;
  // A torque counts as the force that moves the surface of a ball as much. Joints are bilateral:
  // their loads count at once.
  const std::vector<double> hanging_kg = find_hanging();
  for (size_t i = 0; i < state_.joints.size(); ++i) {
    const Joint& joint = state_.joints[i];
    const double radius_m = shape_of(joint.a).radius_m;
    const double torque_nm = joint.torque_nm.norm() + std::abs(joint.limit_nm);
    const double force_n = carries_nothing(joint) ? gravity * hanging_kg[i] : joint.force_n.norm();
    add(joint.a, joint.b == Joint::kWorld ? kNone : joint.b, force_n + 2.5 * torque_nm / radius_m,
        kJointRate, 1);
  }
  for (const uint32_t i : movers_) {
    bodies_[i].load_rate2 = std::max(bodies_[i].load_rate2, loads_[i]);
  }
}

// For each joint the mass of all that is joined with it, kg: one that carries nothing, as before
// its first step, may come to carry so much at once. Empty: there is none.
std::vector<double> StepSolver::find_hanging() const {
  std::vector<double> hanging_kg;
  if (std::ranges::none_of(state_.joints, carries_nothing)) return hanging_kg;
  DisjointSets joined;
  joined.reset(bodies_.size());
  for (const Joint& joint : state_.joints) {
    if (joint.b != Joint::kWorld) joined.unite(joint.a, joint.b);
  }
  std::vector<double> mass_kg(bodies_.size(), 0);
  for (uint32_t i = 0; i < bodies_.size(); ++i) mass_kg[joined.find(i)] += bodies_[i].mass_kg;
  for (const Joint& joint : state_.joints) hanging_kg.push_back(mass_kg[joined.find(joint.a)]);
  return hanging_kg;
}

// Its loads, and what a body that carries nothing needs to be stopped well.
double StepSolver::rate2(uint32_t body) const {
  const double scale = accuracy_ / kResolution;
  const double of_size = settings_.gravity.norm() /
                         (kSubstepOfSize * kSubstepOfSize * shape_of(body).smallest_extent_m);
  return std::max(
      {bodies_[body].load_rate2, of_size / scale, 1 / (scale * kLongestSubstep * kLongestSubstep)});
}

// Islands that need as many substeps are solved together, but for that of the partner's bodies.
std::vector<StepSolver::Group> StepSolver::group(std::span<const uint32_t> touching,
                                                 const Partner& partner) {
  const auto is_awake = [&](uint32_t i) { return i != kNone && bodies_[i].is_awake(); };
  if (islands_.size() != bodies_.size()) islands_.reset(bodies_.size());
  for (const uint32_t i : movers_) islands_.part(i);
  for (const uint32_t t : touching) {
    const Pair& pair = state_.pairs[t];
    if (is_awake(pair.a) && is_awake(pair.b)) islands_.unite(pair.a, pair.b);
  }
  for (const Joint& joint : state_.joints) {
    if (joint.b == Joint::kWorld) continue;
    if (is_awake(joint.a) && is_awake(joint.b)) islands_.unite(joint.a, joint.b);
  }
  uint32_t shared = kNone;  // one of the partner's bodies
  for (const uint32_t i : partner.bodies) {
    if (!is_awake(i)) continue;
    if (shared == kNone) shared = i;
    islands_.unite(i, shared);
  }
  const uint32_t shared_island = shared == kNone ? kNone : islands_.find(shared);
  for (const uint32_t i : movers_) loads_[i] = 0;  // of islands
  for (const uint32_t i : movers_) {
    double& of_island = loads_[islands_.find(i)];
    of_island = std::max(of_island, rate2(i));
  }
  std::vector<Group> groups;
  const auto group_of = [&](uint32_t body) -> Group& {
    const uint32_t island = islands_.find(body);
    const int substeps = substeps_for(settings_.step_s, loads_[island]);
    const bool is_shared = island == shared_island;
    const auto found = std::ranges::find_if(groups, [&](const Group& group) {
      return group.substeps == substeps && group.has_partner == is_shared;
    });
    if (found != groups.end()) return *found;
    return groups.emplace_back(Group{.substeps = substeps, .has_partner = is_shared});
  };
  for (const uint32_t i : movers_) group_of(i).bodies.push_back(i);
  for (const uint32_t t : touching) {
    const Pair& pair = state_.pairs[t];
    if (!is_awake(pair.a) && !is_awake(pair.b)) continue;
    group_of(is_awake(pair.a) ? pair.a : pair.b).touching.push_back(t);
  }
  for (uint32_t j = 0; j < state_.joints.size(); ++j) {
    const Joint& joint = state_.joints[j];
    const uint32_t b = joint.b == Joint::kWorld ? kNone : joint.b;
    if (!is_awake(joint.a) && !is_awake(b)) continue;
    group_of(is_awake(joint.a) ? joint.a : b).joints.push_back(j);
  }
  return groups;
}

void StepSolver::make_bodies(std::span<const double> advanced_s) {
  solver_bodies_.resize(moving_);
  parallel_for(moving_, kGrain, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      const Body& body = bodies_[body_at_[i]];
      const CollisionShape& shape = shapes_[body.shape];
      SolverBody& solved = solver_bodies_[i];
      solved = {};
      solved.velocity = body.velocity;
      solved.spin = body.spin;
      solved.inverse_mass = 1 / body.mass_kg;
      solved.inverse_inertia = inverse_inertia(body, shape);
      solved.moments = principal_moments(body, shape);
      solved.axes = body.orientation * shape.axes;
      solved.share = 1 - advanced_s[body_at_[i]] / settings_.step_s;
      solved.turned_spin = turned_spin(solved);
    }
  });
}

// A body keeps its angular momentum, not its spin, as it turns. Fast ones do so in each substep
// (ContactSolver::turn_freely), others in the step.
Vec3 StepSolver::turned_spin(const SolverBody& body) const {
  const double speed = body.spin.norm();
  const double uneven = body.moments.maxCoeff() / body.moments.minCoeff() - 1;
  const bool is_slow = speed * settings_.step_s / settings_.substeps <= kLeastTurn;
  if (!is_slow || speed * settings_.step_s * uneven < kSameSpin) return Vec3::Zero();
  Quat turn = Quat::Identity();
  Vec3 after = body.spin;
  rotate_freely(body.moments, body.axes, body.share * settings_.step_s, turn, after);
  return after - body.spin;
}

void StepSolver::turn_surfaces() {
  surfaces_.clear();
  for (const uint32_t i : running_) {
    surfaces_.push_back(world_surface_velocity(model_, i, bodies_[i].orientation));
  }
}

// A body on a surface that speeds up and slows down feels each substep's velocity: that of the
// whole step would throw it off where it changes by less than gravity does.
void StepSolver::list_paths() {
  settings_.paths.clear();
  const double h = settings_.step_s / settings_.substeps;
  for (const auto& [body, time_s] : followed_) {
    if (place_[body] == kNone) continue;
    SolverPath& path = settings_.paths.emplace_back();
    path.body = place_[body];
    const ModelBody& source = model_.bodies[body];
    const ModelShape& shape = model_.shapes[source.shape];
    Pose from = pose_at(shape, source.motion, time_s);
    for (int i = 1; i <= settings_.substeps; ++i) {
      const Pose to = pose_at(shape, source.motion, time_s + i * h);
      path.velocity.push_back((to.position - from.position) / h);
      path.spin.push_back(turn_between(from.orientation, to.orientation) / h);
      from = to;
    }
  }
}

uint32_t StepSolver::place_of(uint32_t index) {
  if (place_[index] == kNone) {
    place_[index] = static_cast<uint32_t>(solver_bodies_.size());
    solver_bodies_.push_back({bodies_[index].velocity, bodies_[index].spin});
    body_at_.push_back(index);
  }
  return place_[index];
}

void StepSolver::list_contacts(std::span<const uint32_t> touching) {
  ranges_.clear();
  std::vector<uint64_t> joined_pairs;
  for (const Joint& joint : state_.joints) {
    if (joint.b != Joint::kWorld) joined_pairs.push_back(Pair{joint.a, joint.b}.key());
  }
  std::ranges::sort(joined_pairs);
  const auto surface_of = [&](uint32_t body) -> const SurfaceVelocity* {
    const auto found = std::ranges::lower_bound(running_, body);
    if (found == running_.end() || *found != body) return nullptr;
    return &surfaces_[static_cast<size_t>(found - running_.begin())];
  };
  // For some pairs that follow each other; by bodies, as yet.
  std::vector<std::vector<ContactRange>> parts((touching.size() + kGrain - 1) / kGrain);
  parallel_for(touching.size(), kGrain, [&](size_t begin, size_t end) {
    std::vector<ContactRange>& ranges = parts[begin / kGrain];
    ranges.reserve(end - begin);
    for (const uint32_t t : touching.subspan(begin, end - begin)) {
      const Pair& pair = state_.pairs[t];
      const Body &a = bodies_[pair.a], &b = bodies_[pair.b];
      const double friction = std::sqrt(a.friction * b.friction);
      const double restitution = std::sqrt(a.restitution * b.restitution);
      const bool is_joined =
          !joined_pairs.empty() && std::ranges::binary_search(joined_pairs, pair.key());
      const TorqueArms arms = resistance_.between(pair.a, pair.b);
      const double slop = kResolution * smaller_extent(shape_of(pair.a), shape_of(pair.b));
      // Contacts of one range were found at one time.
      const std::span<Contact> contacts = state_.contacts_of(pair);
      const auto count = static_cast<uint32_t>(contacts.size());
      for (uint32_t first = 0, last = 1; first < count; first = last++) {
        while (last < count && last < first + kMostOfPlane &&
               contacts[last].time_s == contacts[first].time_s) {
          ++last;
        }
        const std::span<Contact> own = contacts.subspan(first, last - first);
        const bool collides = std::ranges::any_of(own, &Contact::is_impact);
        ranges.push_back({own.data(), last - first, pair.a, pair.b, friction, restitution, slop,
                          is_joined, collides, arms, surface_of(pair.a), surface_of(pair.b)});
      }
    }
  });
  for (const std::vector<ContactRange>& ranges : parts) {
    for (ContactRange range : ranges) {
      range.a = place_of(range.a);
      range.b = place_of(range.b);
      ranges_.push_back(range);
    }
  }
}

// From b's attitude as it is meant to b's as it is.
Quat StepSolver::bent(const Joint& joint) const {
  const Quat meant = bodies_[joint.a].orientation * joint.attitude;
  return (joint.b == Joint::kWorld ? Quat::Identity() : bodies_[joint.b].orientation) *
         meant.conjugate();
}

bool StepSolver::is_torn(const Joint& joint) const {
  const Body &a = bodies_[joint.a], &b = bodies_[joint.b];
  const Vec3 apart =
      b.position + b.orientation * joint.point_b - (a.position + a.orientation * joint.point_a);
  const Quat turn = bent(joint);
  return apart.norm() > joint.tears_m ||
         2 * std::atan2(turn.vec().norm(), std::abs(turn.w())) > joint.tears_rad;
}

void StepSolver::list_joints(std::span<const uint32_t> joints) {
  solver_joints_.clear();
  joint_at_.clear();
  uint32_t nobody = kNone;
  for (const uint32_t i : joints) {
    const Joint& joint = state_.joints[i];
    const Body& a = bodies_[joint.a];
    const bool of_b = joint.b != Joint::kWorld;
    if (!of_b && nobody == kNone) {
      nobody = static_cast<uint32_t>(solver_bodies_.size());
      solver_bodies_.push_back({Vec3::Zero(), Vec3::Zero()});
      body_at_.push_back(kNone);
    }
    SolverJoint made;
    made.a = place_of(joint.a);
    made.b = of_b ? place_of(joint.b) : nobody;
    made.arm_a = a.orientation * joint.point_a;
    made.axis_a = a.orientation * joint.axis_a;
    made.arm_b = of_b ? Vec3(bodies_[joint.b].orientation * joint.point_b) : Vec3::Zero();
    made.axis_b = of_b ? Vec3(bodies_[joint.b].orientation * joint.axis_b) : joint.axis_b;
    made.apart = (of_b ? Vec3(bodies_[joint.b].position + made.arm_b) : joint.point_b) -
                 (a.position + made.arm_a);
    made.holds = joint.holds;
    made.bent = bent(joint);
    if (joint.is_glue) {
      made.strength_n = joint.strength_n;
      made.strength_nm = joint.strength_nm;
    }
    made.least_turn = joint.least_turn;
    made.most_turn = joint.most_turn;
    made.motor_rad_s = joint.motor_rad_s;
    made.motor_most_nm = joint.motor_most_nm;
    made.motor_nm = joint.motor_nm;
    made.limit_nm = joint.limit_nm;
    made.turn = joint.turn;
    made.force_n = joint.force_n;
    made.torque_nm = joint.torque_nm;
    // Torque across a nail is partly along it once it has turned, and would drive the bodies
    // about it. The axis of a hinge stays.
    if (of_b && joint.holds == Holds::axis)
      made.torque_nm -= made.axis_a * made.axis_a.dot(joint.torque_nm);
    solver_joints_.push_back(made);
    joint_at_.push_back(i);
  }
}

void StepSolver::take_over_joints() {
  for (size_t i = 0; i < joint_at_.size(); ++i) {
    Joint& joint = state_.joints[joint_at_[i]];
    joint.force_n = solver_joints_[i].force_n;
    joint.torque_nm = solver_joints_[i].torque_nm;
    joint.motor_nm = solver_joints_[i].motor_nm;
    joint.limit_nm = solver_joints_[i].limit_nm;
    joint.turn = solver_joints_[i].turn;
    const double breaking_ns =
        std::min(joint.breaking_impulse_ns, settings_.step_s * joint.breaking_force_n);
    const bool breaks =
        joint.is_glue ? is_torn(joint) : solver_joints_[i].push_ns.norm() >= breaking_ns;
    if (breaks) broken_.push_back(joint.id);
  }
}

void StepSolver::take_over_bodies() {
  parallel_for(moving_, kGrain, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      const uint32_t index = body_at_[i];
      if (is_touched_[index] == 0) {  // it flies
        place_[index] = kNone;
        continue;
      }
      Body& body = bodies_[index];
      const SolverBody& solved = solver_bodies_[i];
      body.velocity = solved.velocity;
      body.spin = solved.spin;
      body.position += solved.displacement;
      body.orientation = (solved.turn * body.orientation).normalized();
      body.moved += solved.displacement;
      body.turned_m += 2 * solved.turn.vec().norm() * shape_of(index).turning_radius_m;
    }
  });
}

}  // namespace pilesim::exact
