#include "simulate/exact/step_solver.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/parallel_for.h"
#include "simulate/exact/exact_constants.h"

namespace pilesim::exact {

using namespace exact_constants;

namespace {

constexpr size_t kGrain = 128;

SolverSettings settings_of(const Scene& scene, const Model& model, bool is_few) {
  SolverSettings settings{.step_s = scene.actual_step_s(),
                          .push_time_s = kUsualPushTime,
                          .push_speed = kUsualPushSpeed,
                          .gravity = scene.gravity,
                          .shared_sweeps = scene.simulator.solver_iterations};
  if (is_few) {
    settings.relaxations = kRelaxationsOfFew;
    settings.is_thorough = true;
  }
  const double gravity = scene.gravity.norm();
  double least_radius = std::numeric_limits<double>::infinity();
  for (const ModelBody& body : model.bodies) {
    if (body.role != Role::dynamic) continue;
    least_radius = std::min(least_radius, model.shapes[body.shape].bounding_radius);
  }
  if (gravity > 0 && std::isfinite(least_radius)) {
    settings.push_time_s = kPushTime * std::sqrt(least_radius / gravity);
    settings.push_speed = kPushSpeed * std::sqrt(least_radius * gravity);
  }
  return settings;
}

bool has_few(const Model& model) {
  return static_cast<size_t>(std::ranges::count(model.bodies, Role::dynamic, &ModelBody::role)) <=
         kFewBodies;
}

bool has_heavy(const Model& model) {
  double least_kg = std::numeric_limits<double>::infinity(), most_kg = 0;
  for (const ModelBody& body : model.bodies) {
    if (body.role != Role::dynamic) continue;
    least_kg = std::min(least_kg, body.mass_kg);
    most_kg = std::max(most_kg, body.mass_kg);
  }
  return most_kg >= kHeavy * least_kg;
}

// What hits hard, or is sunk in a scene of few, is gone over more often.
int rounds_over(std::span<const Contact> contacts, double shallow_m, bool is_few) {
  int rounds = 1;
  for (const Contact& contact : contacts) {
    if (contact.hits) rounds = std::max(rounds, kHardRounds);
    if (is_few && contact.distance_m < -shallow_m) rounds = std::max(rounds, kSunkRoundsOfFew);
  }
  return rounds;
}

}  // namespace

StepSolver::StepSolver(const Scene& scene, const Model& model,
                       std::span<const CollisionShape> shapes, EngineState& state)
    : shapes_(shapes),
      state_(state),
      bodies_(state.bodies),
      resistance_(model),
      is_few_(has_few(model)),
      has_heavy_(has_heavy(model)),
      settings_(settings_of(scene, model, is_few_)),
      place_(model.bodies.size(), kNone) {
  settings_.has_torques = !resistance_.is_none();
}

Vec3 StepSolver::velocity(uint32_t body) const {
  return is_few_ ? few_.velocity(place_[body]) : many_.velocity(place_[body]);
}

Vec3 StepSolver::spin(uint32_t body) const {
  return is_few_ ? few_.spin(place_[body]) : many_.spin(place_[body]);
}

void StepSolver::change_velocity(uint32_t body, const Vec3& linear, const Vec3& angular) {
  if (linear.isZero(0) && angular.isZero(0)) return;
  met_[body] = 1;
  if (is_few_) return few_.change_velocity(place_[body], linear, angular);
  many_.change_velocity(place_[body], linear, angular);
}

void StepSolver::solve(std::span<const uint32_t> touching, std::span<const double> ahead_s,
                       const std::function<void(int)>& partner) {
  list_bodies(touching, ahead_s, static_cast<bool>(partner));
  const int least_substeps = std::exchange(least_substeps_, 0);
  if (moving_ == 0) return;
  list_contacts(touching);
  list_joints();
  settings_.partner = partner;
  settings_.substeps = is_few_ ? kSubstepsOfFew : kSubstepsOfMany;
  settings_.substeps = std::max({settings_.substeps, least_substeps, substeps_of_loads(touching)});
  if (std::ranges::any_of(solver_joints_, &SolverJoint::is_glue)) {
    settings_.substeps = std::max(settings_.substeps, kSubstepsOfGlue);
  }
  if (is_few_) {
    few_.solve(settings_, solver_bodies_, moving_, ranges_, solver_joints_);
  } else {
    many_.solve(settings_, solver_bodies_, moving_, ranges_, solver_joints_);
  }
  take_over_bodies();
  take_over_joints();
}

// What lies under something much heavier gives by as many weights as it carries, times the square
// of a substep.
int StepSolver::substeps_of_loads(std::span<const uint32_t> touching) {
  // For a while: springs that are soft when they are pressed in and stiff when they push back drive
  // what rocks on them.
  state_.load_steps = has_load(touching) ? kStepsOfLoad : std::max(0, state_.load_steps - 1);
  return state_.load_steps > 0 ? kSubstepsOfLoad : 0;
}

bool StepSolver::has_load(std::span<const uint32_t> touching) const {
  const double gravity = settings_.gravity.norm();
  return has_heavy_ && gravity > 0 && std::ranges::any_of(touching, [&](uint32_t t) {
           const Pair& pair = state_.pairs[t];
           if (!bodies_[pair.a].is_awake() && !bodies_[pair.b].is_awake()) return false;
           const bool a_is_light = bodies_[pair.a].mass_kg < bodies_[pair.b].mass_kg;
           const Body &light = bodies_[a_is_light ? pair.a : pair.b],
                      &heavy = bodies_[a_is_light ? pair.b : pair.a];
           if (heavy.mass_kg < kHeavy * light.mass_kg || !(light.mass_kg > 0)) return false;
           // A blow is no load.
           const double slow =
               kSlowLoad * std::sqrt(gravity * shapes_[light.shape].smallest_extent_m);
           if ((heavy.velocity - light.velocity).norm() > slow) return false;
           return std::ranges::any_of(state_.contacts_of(pair), [&](const Contact& contact) {
             return contact.push_n > kLoad * light.mass_kg * gravity;
           });
         });
}

// Those that something may push come first: by the partner, any.
void StepSolver::list_bodies(std::span<const uint32_t> touching, std::span<const double> ahead_s,
                             bool has_partner) {
  std::ranges::fill(place_, kNone);
  body_at_.clear();
  met_.assign(bodies_.size(), 0);
  for (const uint32_t t : touching) met_[state_.pairs[t].a] = met_[state_.pairs[t].b] = 1;
  for (const Joint& joint : state_.joints) {
    met_[joint.a] = 1;
    if (joint.b != Joint::kWorld) met_[joint.b] = 1;
  }
  for (uint32_t i = 0; i < bodies_.size(); ++i) {
    if ((met_[i] == 0 && !has_partner) || !bodies_[i].is_awake()) continue;
    place_[i] = static_cast<uint32_t>(body_at_.size());
    body_at_.push_back(i);
  }
  moving_ = body_at_.size();
  if (!is_few_) {
    order_.sort(body_at_, [&](uint32_t i) -> const Vec3& { return bodies_[i].position; });
    for (uint32_t i = 0; i < moving_; ++i) place_[body_at_[i]] = i;
  }
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
      solved.share = 1 - ahead_s[body_at_[i]] / settings_.step_s;
    }
  });
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
  // Of some pairs that follow each other; by bodies, as yet.
  std::vector<std::vector<ContactRange>> parts((touching.size() + kGrain - 1) / kGrain);
  parallel_for(touching.size(), kGrain, [&](size_t begin, size_t end) {
    std::vector<ContactRange>& ranges = parts[begin / kGrain];
    ranges.reserve(end - begin);
    for (const uint32_t t : touching.subspan(begin, end - begin)) {
      const Pair& pair = state_.pairs[t];
      const Body &a = bodies_[pair.a], &b = bodies_[pair.b];
      if (!a.is_awake() && !b.is_awake()) continue;
      const double friction = std::sqrt(a.friction * b.friction);
      const bool is_joined =
          !joined_pairs.empty() && std::ranges::binary_search(joined_pairs, pair.key());
      const TorqueArms arms = resistance_.between(pair.a, pair.b);
      const double shallow = kShallow * smaller_extent(shape_of(pair.a), shape_of(pair.b));
      // Contacts of one range were found at one time.
      const std::span<Contact> contacts = state_.contacts_of(pair);
      const auto count = static_cast<uint32_t>(contacts.size());
      for (uint32_t first = 0, last = 1; first < count; first = last++) {
        while (last < count && last < first + kMostOfPlane &&
               contacts[last].time_s == contacts[first].time_s) {
          ++last;
        }
        const std::span<Contact> own = contacts.subspan(first, last - first);
        ranges.push_back({own.data(), last - first, pair.a, pair.b, friction, shallow, is_joined,
                          rounds_over(own, shallow, is_few_), arms});
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

// Of glue: from b's attitude as it is meant to b's as it is.
Quat StepSolver::bent(const Joint& joint) const {
  return bodies_[joint.b].orientation * (bodies_[joint.a].orientation * joint.attitude).conjugate();
}

bool StepSolver::is_torn(const Joint& joint) const {
  const Body &a = bodies_[joint.a], &b = bodies_[joint.b];
  const Vec3 apart =
      b.position + b.orientation * joint.point_b - (a.position + a.orientation * joint.point_a);
  const Quat turn = bent(joint);
  return apart.norm() > joint.tears_m ||
         2 * std::atan2(turn.vec().norm(), std::abs(turn.w())) > joint.tears_rad;
}

void StepSolver::list_joints() {
  solver_joints_.clear();
  joint_at_.clear();
  uint32_t nobody = kNone;
  for (size_t i = 0; i < state_.joints.size(); ++i) {
    const Joint& joint = state_.joints[i];
    const Body& a = bodies_[joint.a];
    const bool of_b = joint.b != Joint::kWorld;
    if (!a.is_awake() && !(of_b && bodies_[joint.b].is_awake())) continue;
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
    if (joint.is_glue) {
      made.is_glue = true;
      made.bent = bent(joint);
      made.strength_n = joint.strength_n;
      made.strength_nm = joint.strength_nm;
    }
    made.force_n = joint.force_n;
    made.torque_nm = joint.torque_nm;
    // What was across a nail is partly along it once it has turned, and would drive the bodies
    // about it. The axis of a hinge stays.
    if (of_b && !joint.is_glue) made.torque_nm -= made.axis_a * made.axis_a.dot(joint.torque_nm);
    solver_joints_.push_back(made);
    joint_at_.push_back(i);
  }
}

void StepSolver::take_over_joints() {
  broken_.clear();
  for (size_t i = 0; i < joint_at_.size(); ++i) {
    Joint& joint = state_.joints[joint_at_[i]];
    joint.force_n = solver_joints_[i].force_n;
    joint.torque_nm = solver_joints_[i].torque_nm;
    const bool breaks = joint.is_glue
                            ? is_torn(joint)
                            : solver_joints_[i].push_ns.norm() >= joint.breaking_impulse_ns;
    if (breaks) broken_.push_back(joint.id);
  }
  // In the order of their ids; hinges, which have none of their own, never break.
  std::erase_if(state_.joints,
                [&](const Joint& joint) { return std::ranges::binary_search(broken_, joint.id); });
}

void StepSolver::take_over_bodies() {
  parallel_for(moving_, kGrain, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      const uint32_t index = body_at_[i];
      if (met_[index] == 0) {  // it flies
        place_[index] = kNone;
        continue;
      }
      Body& body = bodies_[index];
      const SolverBody& solved = solver_bodies_[i];
      body.velocity = solved.velocity;
      body.spin = solved.spin;
      body.position += solved.way;
      body.orientation = (solved.turn * body.orientation).normalized();
      body.moved += solved.way;
      body.turned_m += 2 * solved.turn.vec().norm() * shape_of(index).radius_m;
    }
  });
}

}  // namespace pilesim::exact
