#include "finish/exact_rest.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "finish/finish_constants.h"
#include "finish/walls.h"
#include "simulate/exact/engine.h"
#include "simulate/exact/exact_constants.h"

namespace pilesim {

using namespace finish_constants;

namespace {

// How restless a body is.
constexpr uint8_t kStill = 0, kRestless = 1, kStirring = 2;

double gravity_of(const Scene& scene) {
  const double gravity = scene.gravity.norm();
  return gravity > 0 ? gravity : kUsualGravity;
}

// Of the smallest dynamic body; 1 where there is none.
double least_radius_m(const Model& model) {
  double radius = std::numeric_limits<double>::infinity();
  for (const ModelBody& body : model.bodies) {
    if (body.role == Role::dynamic) {
      radius = std::min(radius, model.shapes[body.shape].bounding_radius);
    }
  }
  return std::isfinite(radius) ? radius : 1;
}

// A frame of it is a step. Who sleeps is found here, not by the engine.
Scene with_step(Scene scene, double step_s) {
  scene.step_s = step_s;
  scene.frame_rate = 1 / step_s;
  scene.simulator.sleeping = false;
  return scene;
}

Scene parting_scene(Scene scene, double radius_m) {
  scene.gravity.setZero();
  return with_step(std::move(scene), kPartingWay * radius_m / exact_constants::kUsualPushSpeed);
}

Model without_restitution(Model model) {
  for (Material& material : model.materials) material.restitution = 0;
  return model;
}

bool is_slow(const ModelShape& shape, double gravity, const BodyMotion& motion) {
  const double limit = kStillSpeed * std::sqrt(gravity * shape.bounding_radius);
  const Vec3 spin = motion.orientation.conjugate() * motion.angular_velocity;
  return motion.linear_velocity.norm() <= limit &&
         felt_turn_rate(shape.mass.inertia_m5, spin) * shape.bounding_radius <= limit;
}

}  // namespace

ExactRest::ExactRest(const Scene& scene, const Model& model, BodyStates start,
                     std::optional<double> longest_s)
    : parting_(parting_scene(scene, least_radius_m(model))),
      model_(without_restitution(model)),
      states_(std::move(start)) {
  const double unit_s = std::sqrt(least_radius_m(model) / gravity_of(scene));
  settling_ = with_step(scene, kStep * unit_s);
  longest_s_ = longest_s.value_or(kLongest * unit_s);
  for (uint32_t i = 0; i < states_.size(); ++i) {
    states_.linear_velocity[i].setZero();
    states_.angular_velocity[i].setZero();
    if (!is_free(i)) continue;
    movable_.push_back(i);
    way_end_.emplace_back(states_.position[i].cast<float>());
  }
  draw_back_from_walls(model_, movable_, states_);
  engine_ = engine_at(parting_);
  is_at_rest_ = movable_.empty();
}

ExactRest::~ExactRest() = default;

bool ExactRest::is_free(uint32_t body) const {
  constexpr uint8_t kStands = kHeld | kFrozen;
  return model_.bodies[body].role == Role::dynamic && (states_.flags[body] & kPresent) != 0 &&
         (states_.flags[body] & kStands) == 0;
}

// Deeper than this it is sunk.
double ExactRest::most_depth_m(uint32_t body) const {
  const ModelShape& shape = model_.shapes[model_.bodies[body].shape];
  return std::min(kStillDepth * 2 * shape.bounding_radius,
                  kStillDepthInExtents * shape.smallest_extent);
}

bool ExactRest::is_time_for_sunk() const { return kStep * settling_steps_ < kSunkTime; }

std::unique_ptr<ExactEngine> ExactRest::engine_at(const Scene& scene) const {
  auto engine = make_exact_engine(scene, model_);
  for (uint32_t i = 0; i < states_.size(); ++i) {
    if ((states_.flags[i] & kPresent) == 0) continue;
    const bool stands = model_.bodies[i].role == Role::dynamic && !is_free(i);
    engine->add(i, {.position = states_.position[i], .orientation = states_.orientation[i]}, stands,
                false);
  }
  return engine;
}

FrameStatistics ExactRest::step() {
  timer_.take();
  engine_->step(timer_, [] {});
  is_parted_ ? settle() : part();
  if ((parting_steps_ + settling_steps_) % kWaySteps == 0) keep_ways();
  return statistics();
}

// After a step without gravity.
void ExactRest::part() {
  stop_all();
  ++parting_steps_;
  if (parting_steps_ < kPartingSteps || parting_steps_ % kPartingRound != 0) return;
  engine_->read_contacts(contacts_);
  Marks sunk(model_.bodies.size(), kStill);
  mark_sunk(sunk);
  is_parted_ = std::ranges::none_of(sunk, [](uint8_t mark) { return mark != kStill; }) ||
               parting_steps_ >= kPartingSteps + kMorePartingSteps;
  if (is_parted_) {
    read_states();
    engine_ = engine_at(settling_);
    begin_to_watch();
  } else {
    leave_in_solver(around(sunk, kRestless, kRings));
    push_apart(sunk);
  }
}

// After a step under gravity.
void ExactRest::settle() {
  time_s_ += settling_.actual_step_s();
  ++settling_steps_;
  if (kStep * settling_steps_ < kCalmTime) slow_down();
  static const int kLookSteps = static_cast<int>(std::lround(kStillTime / kStep));
  if (settling_steps_ % kLookSteps == 0) look();
}

void ExactRest::stop_all() {
  for (const uint32_t body : movable_) {
    if (engine_->is_active(body)) engine_->set_velocity(body, Vec3::Zero(), Vec3::Zero());
  }
}

void ExactRest::slow_down() {
  for (const uint32_t body : movable_) {
    if (!engine_->is_active(body)) continue;
    const BodyMotion motion = engine_->motion(body);
    engine_->set_velocity(body, kCalmShare * motion.linear_velocity,
                          kCalmShare * motion.angular_velocity);
  }
}

// Each body that is sunk, out of the first it is sunk into.
void ExactRest::push_apart(const Marks& sunk) {
  Marks left = sunk;
  for (const BodyContact& contact : contacts_) {
    const Vec3 way = -kNudge * contact.distance_m * contact.normal;
    for (const auto& [body, sign] : {std::pair(contact.a, 1.0), std::pair(contact.b, -1.0)}) {
      if (left[body] == kStill || contact.distance_m > -most_depth_m(body)) continue;
      if (engine_->is_active(body)) engine_->nudge(body, sign * way, Quat::Identity());
      left[body] = kStill;
    }
  }
}

void ExactRest::keep_ways() {
  for (size_t i = 0; i < movable_.size(); ++i) {
    const uint32_t body = movable_[i];
    if (!engine_->is_active(body)) continue;
    const BodyMotion motion = engine_->motion(body);
    const Vec3f place = motion.position.cast<float>();
    const double far = kWayStep * model_.shapes[model_.bodies[body].shape].bounding_radius;
    if ((place - way_end_[i]).norm() < far) continue;
    way_end_[i] = place;
    ways_.push_back({body, place, motion.orientation.cast<float>()});
  }
}

std::vector<WayPoint> ExactRest::take_ways() {
  std::ranges::stable_sort(ways_, {}, &WayPoint::body);
  return std::move(ways_);
}

void ExactRest::read_states() {
  for (const uint32_t body : movable_) {
    const BodyMotion motion = engine_->motion(body);
    states_.position[body] = motion.position;
    states_.orientation[body] = motion.orientation;
    states_.linear_velocity[body] = motion.linear_velocity;
    states_.angular_velocity[body] = motion.angular_velocity;
    states_.flags[body] &= static_cast<uint8_t>(~kAsleep);
    if (!engine_->is_active(body)) states_.flags[body] |= kAsleep;
  }
}

const BodyStates& ExactRest::states() {
  read_states();
  return states_;
}

void ExactRest::begin_to_watch() {
  watched_.resize(movable_.size());
  for (size_t i = 0; i < movable_.size(); ++i) {
    const BodyMotion motion = engine_->motion(movable_[i]);
    watched_[i] = {motion.position, motion.orientation};
  }
}

// At the end of each time for which bodies may have been still.
void ExactRest::look() {
  engine_->read_contacts(contacts_);
  const Marks marks = restless();
  const auto count = static_cast<size_t>(
      std::ranges::count_if(movable_, [&](uint32_t body) { return marks[body] != kStill; }));
  is_at_rest_ = count == 0;
  still_ = movable_.size() - count;
  const double few = kFew * static_cast<double>(movable_.size());
  few_are_restless_ = few_are_restless_ || static_cast<double>(count) <= few;
  if (few_are_restless_) {
    Marks meant = around(marks, kRestless, kRings);
    const Marks roused = around(marks, kStirring, 1);
    for (const uint32_t body : movable_) {
      // What waits goes on to do so unless something stirs at it.
      meant[body] = (meant[body] && engine_->is_active(body)) || roused[body] ? 1 : 0;
    }
    leave_in_solver(meant);
    if (is_time_for_sunk()) {
      Marks sunk(model_.bodies.size(), kStill);
      mark_sunk(sunk);
      push_apart(sunk);
    }
  }
  begin_to_watch();
}

// Of the bodies in the solver.
ExactRest::Marks ExactRest::restless() const {
  Marks marks(model_.bodies.size(), kStill);
  const double gravity = gravity_of(settling_);
  for (size_t i = 0; i < movable_.size(); ++i) {
    const uint32_t body = movable_[i];
    if (!engine_->is_active(body)) continue;
    const ModelShape& shape = model_.shapes[model_.bodies[body].shape];
    const double radius = shape.bounding_radius;
    const BodyMotion motion = engine_->motion(body);
    const double strayed = (motion.position - watched_[i].position).norm() +
                           radius * motion.orientation.angularDistance(watched_[i].orientation);
    if (strayed > kStillDrift * radius || !is_slow(shape, gravity, motion)) {
      marks[body] = kRestless;
    }
    if (strayed > kStirringDrift * radius) marks[body] = kStirring;
  }
  if (is_time_for_sunk()) mark_sunk(marks);
  return marks;
}

void ExactRest::mark_sunk(Marks& marks) const {
  for (const BodyContact& contact : contacts_) {
    for (const uint32_t body : {contact.a, contact.b}) {
      if (contact.distance_m < -most_depth_m(body) && is_free(body)) {
        marks[body] = std::max(marks[body], kRestless);
      }
    }
  }
}

// 1 for bodies with such a mark or a higher one, and for what up to so many contacts join to them.
ExactRest::Marks ExactRest::around(const Marks& marks, uint8_t least, int rings) const {
  Marks meant(marks.size());
  std::ranges::transform(marks, meant.begin(),
                         [&](uint8_t mark) { return static_cast<uint8_t>(mark >= least); });
  for (int ring = 0; ring < rings; ++ring) {
    Marks wider = meant;
    for (const BodyContact& contact : contacts_) {
      if (!is_free(contact.a) || !is_free(contact.b)) continue;
      wider[contact.a] |= meant[contact.b];
      wider[contact.b] |= meant[contact.a];
    }
    meant = std::move(wider);
  }
  return meant;
}

// The others wait.
void ExactRest::leave_in_solver(const Marks& meant) {
  for (const uint32_t body : movable_) {
    if (meant[body] != 0) {
      engine_->wake(body);
    } else if (engine_->is_active(body)) {
      engine_->put_to_sleep(body);
    }
  }
}

FrameStatistics ExactRest::statistics() {
  FrameStatistics statistics;
  statistics.steps = 1;
  for (const uint8_t flags : states_.flags) {
    if ((flags & kPresent) != 0) ++statistics.bodies_present;
  }
  for (const uint32_t body : movable_) {
    if (engine_->is_active(body)) ++statistics.bodies_awake;
    statistics.kinetic_energy_j += engine_->kinetic_energy_j(body);
    statistics.potential_energy_j -=
        model_.bodies[body].mass_kg * settling_.gravity.dot(engine_->motion(body).position);
  }
  engine_->add_contacts_to(statistics);
  statistics.times = timer_.take();
  return statistics;
}

}  // namespace pilesim
