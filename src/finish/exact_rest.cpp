#include "finish/exact_rest.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <span>

#include "finish/burial.h"
#include "finish/finish_constants.h"
#include "finish/walls.h"
#include "simulate/exact/engine.h"
#include "simulate/exact/exact_constants.h"

namespace pilesim {

using namespace finish_constants;

namespace {

// Levels of motion of a body.
constexpr uint8_t kStill = 0, kRestless = 1, kMoving = 2;

double gravity_of(const Scene& scene) {
  const double gravity = scene.gravity.norm();
  return gravity > 0 ? gravity : kUsualGravity;
}

// Lengths are told in radii of the smallest body.
double unit_m(const Model& model) {
  const double radius_m = least_radius_m(model);
  return std::isfinite(radius_m) ? radius_m : 1;
}

// One frame is one step. ExactRest decides which bodies sleep, not the engine.
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

// Removes restitution, and stops belts.
Model for_rest(Model model) {
  for (Material& material : model.materials) material.restitution = 0;
  for (ModelBody& body : model.bodies) body.surface_velocity.reset();
  return model;
}

size_t count_of(std::span<const uint8_t> marks) {
  return static_cast<size_t>(
      std::ranges::count_if(marks, [](uint8_t mark) { return mark != kStill; }));
}

// Combines two sets of marks; either may be empty.
std::vector<uint8_t> with(const std::vector<uint8_t>& more, std::vector<uint8_t> marks) {
  for (size_t i = 0; i < more.size(); ++i) marks[i] = std::max(marks[i], more[i]);
  return marks;
}

bool is_slow(const ModelShape& shape, double gravity, const BodyMotion& motion) {
  const double limit = kStillSpeed * std::sqrt(gravity * shape.bounding_radius);
  const Vec3 spin = motion.orientation.conjugate() * motion.angular_velocity;
  return motion.linear_velocity.norm() <= limit &&
         felt_turn_rate(shape.mass.inertia_m5, spin) * shape.bounding_radius <= limit;
}

}  // namespace

ExactRest::ExactRest(const Scene& scene, const Model& model, BodyStates start,
                     const RestSettings& settings)
    : parting_(parting_scene(scene, unit_m(model))),
      model_(for_rest(model)),
      states_(std::move(start)) {
  state_.left.assign(model.bodies.size(), kNotLeft);
  const double unit_s = std::sqrt(unit_m(model) / gravity_of(scene));
  settling_ = with_step(scene, kStep * unit_s);
  longest_s_ = settings.longest_s.value_or(kLongest * unit_s);
  if (settings.visible_only) leave_what_is_deep();
  std::vector<uint32_t> walls;
  for (uint32_t i = 0; i < states_.size(); ++i) {
    states_.linear_velocity[i].setZero();
    states_.angular_velocity[i].setZero();
    if (is_free(i)) {
      movable_.push_back(i);
      state_.way_end.push_back(states_.position[i]);
    } else if (state_.left[i] == kNotLeft && (states_.flags[i] & kPresent) != 0) {
      walls.push_back(i);
    }
    if (is_loose(i) && !is_free(i)) {
      potential_of_deep_j_ -= model.bodies[i].mass_kg * settling_.gravity.dot(states_.position[i]);
    }
  }
  std::vector<uint32_t> meant;
  std::ranges::copy_if(movable_, std::back_inserter(meant),
                       [&](uint32_t i) { return is_meant(i); });
  draw_back_from_walls(model_, meant, walls, states_);
  engine_ = engine_at(parting_);
  state_.is_at_rest = movable_.empty();
}

ExactRest::~ExactRest() = default;

bool ExactRest::is_loose(uint32_t body) const {
  constexpr uint8_t kStands = kHeld | kFrozen;
  return model_.bodies[body].role == Role::dynamic && (states_.flags[body] & kPresent) != 0 &&
         (states_.flags[body] & kStands) == 0;
}

void ExactRest::leave_what_is_deep() {
  const std::vector<double> depths = depths_under_surface(model_, states_);
  const double diameter_m = mean_diameter_m(model_);
  for (uint32_t i = 0; i < depths.size(); ++i) {
    const double depth = depths[i] / diameter_m;
    if (!is_loose(i) || depth <= kSeenDepth) continue;
    state_.left[i] = depth > kTouchedDepth ? kDeep : depth > kMayGoDepth ? kStays : kMayGo;
    states_.flags[i] |= kAsleep;
  }
}

std::vector<uint32_t> ExactRest::left() const {
  std::vector<uint32_t> left;
  for (uint32_t i = 0; i < state_.left.size(); ++i) {
    if (state_.left[i] != kNotLeft) left.push_back(i);
  }
  return left;
}

size_t ExactRest::movable() const {
  return static_cast<size_t>(
      std::ranges::count_if(movable_, [&](uint32_t body) { return is_meant(body); }));
}

// A body that penetrates deeper is not sound.
double ExactRest::most_depth_m(uint32_t body) const {
  const ModelShape& shape = model_.shapes[model_.bodies[body].shape];
  return std::min(kStillDepth * 2 * shape.bounding_radius,
                  kStillDepthInExtents * shape.smallest_extent);
}

bool ExactRest::is_time_for_penetration() const {
  return kStep * state_.settling_steps < kPenetratingTime ||
         state_.penetrating.since < kStalledLooks;
}

std::unique_ptr<ExactEngine> ExactRest::engine_at(const Scene& scene) const {
  auto engine = make_exact_engine(scene, model_);
  for (uint32_t i = 0; i < states_.size(); ++i) {
    if ((states_.flags[i] & kPresent) == 0 || state_.left[i] == kDeep) continue;
    const bool stands = model_.bodies[i].role == Role::dynamic && !is_free(i);
    engine->add(i, {.position = states_.position[i], .orientation = states_.orientation[i]}, stands,
                false);
    if (is_free(i) && !may_move(i)) engine->put_to_sleep(i);
  }
  return engine;
}

FrameStatistics ExactRest::step() {
  timer_.take();
  engine_->step(timer_, [] {});
  state_.is_parted ? settle() : part();
  if ((state_.parting_steps + state_.settling_steps) % kWaySteps == 0) keep_ways();
  return statistics();
}

// Evaluates a step without gravity.
void ExactRest::part() {
  stop_all();
  ++state_.parting_steps;
  if (state_.parting_steps < kPartingSteps || state_.parting_steps % kPartingRound != 0) return;
  engine_->read_contacts(contacts_);
  Marks pressed;
  if (state_.parting_steps >= kPartingSteps + kMorePartingSteps / 2) pressed = let_go();
  const Marks penetrating = this->penetrating();
  const size_t count = count_of(penetrating);
  state_.penetrating.note(count);
  const bool is_late = state_.parting_steps >= kPartingSteps + kMorePartingSteps;
  state_.is_parted = count == 0 || (is_late && state_.penetrating.since >= kStalledRounds);
  if (state_.is_parted) {
    state_.penetrating = {};
    read_states();
    engine_ = engine_at(settling_);
    begin_to_watch();
  } else {
    leave_in_solver(with(pressed, around(penetrating, kRestless, kRings)));
    push_apart(penetrating);
  }
}

// Evaluates a step with gravity.
void ExactRest::settle() {
  state_.time_s += settling_.actual_step_s();
  ++state_.settling_steps;
  const double time = kStep * state_.settling_steps;
  if (time < kDampedTime || time > kLateTime) slow_down();
  static const int kLookSteps = static_cast<int>(std::lround(kStillTime / kStep));
  if (state_.settling_steps % kLookSteps == 0) look();
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
    engine_->set_velocity(body, kDampedShare * motion.linear_velocity,
                          kDampedShare * motion.angular_velocity);
  }
}

// Moves each penetrating body out of the first one that it penetrates.
void ExactRest::push_apart(const Marks& penetrating) {
  Marks left = penetrating;
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
    const Vec3& place = motion.position;
    const double far = kWayStep * model_.shapes[model_.bodies[body].shape].bounding_radius;
    if ((place - state_.way_end[i]).norm() < far) continue;
    state_.way_end[i] = place;
    state_.ways.push_back({body, place, motion.orientation.cast<float>()});
  }
}

std::vector<WayPoint> ExactRest::take_ways() {
  std::ranges::stable_sort(state_.ways, {}, &WayPoint::body);
  return std::move(state_.ways);
}

void ExactRest::save(StateWriter& writer) const {
  writer(state_);
  engine_->save(writer);
}

void ExactRest::load(StateReader& reader) {
  reader(state_);
  StateReader::require(state_.way_end.size() == movable_.size() &&
                           state_.watched.size() == (state_.is_parted ? movable_.size() : 0) &&
                           state_.left.size() == model_.bodies.size(),
                       "as many places as there are bodies that may move");
  for (const WayPoint& way : state_.ways) {
    StateReader::require(way.body < model_.bodies.size(), "ways of bodies that are there");
  }
  engine_ = engine_at(state_.is_parted ? settling_ : parting_);
  engine_->load(reader);
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
  state_.watched.resize(movable_.size());
  for (size_t i = 0; i < movable_.size(); ++i) {
    const BodyMotion motion = engine_->motion(movable_[i]);
    state_.watched[i] = {motion.position, motion.orientation};
  }
}

// Checks the bodies at the end of each interval in which they may have been at rest.
void ExactRest::look() {
  engine_->read_contacts(contacts_);
  Marks pressed;
  if (is_time_for_penetration()) pressed = let_go();
  const Marks penetrating = this->penetrating();
  state_.penetrating.note(count_of(penetrating));
  Marks marks = restless();
  if (is_time_for_penetration()) {
    std::ranges::transform(marks, penetrating, marks.begin(), std::ranges::max);
  }
  const size_t count = count_of(marks);
  Marks overlooked;
  if (count == 0) overlooked = this->overlooked(penetrating);
  state_.is_at_rest = count == 0 && overlooked.empty();
  state_.still = movable() - count;
  const double few = kFew * static_cast<double>(movable());
  state_.few_are_restless = state_.few_are_restless || static_cast<double>(count) <= few;
  if (state_.few_are_restless) {
    Marks meant = around(marks, kRestless, kRings);
    const Marks woken = around(marks, kMoving, 1);
    for (const uint32_t body : movable_) {
      // Waiting bodies keep waiting unless a neighbour moves.
      meant[body] = (meant[body] && engine_->is_active(body)) || woken[body] ? 1 : 0;
    }
    leave_in_solver(state_.is_at_rest ? Marks(meant.size(), 0)
                                      : with(overlooked, with(pressed, std::move(meant))));
    if (is_time_for_penetration()) push_apart(penetrating);
  }
  begin_to_watch();
}

// Marks active bodies that move but must become sound. Bodies that give way may go on moving.
ExactRest::Marks ExactRest::restless() const {
  Marks marks(model_.bodies.size(), kStill);
  const double gravity = gravity_of(settling_);
  for (size_t i = 0; i < movable_.size(); ++i) {
    const uint32_t body = movable_[i];
    if (!is_meant(body) || !engine_->is_active(body)) continue;
    const ModelShape& shape = model_.shapes[model_.bodies[body].shape];
    const double radius = shape.bounding_radius;
    const BodyMotion motion = engine_->motion(body);
    const double strayed =
        (motion.position - state_.watched[i].position).norm() +
        radius * motion.orientation.angularDistance(state_.watched[i].orientation);
    if (strayed > kStillDrift * radius || !is_slow(shape, gravity, motion)) {
      marks[body] = kRestless;
    }
    if (strayed > kWakingDrift * radius) marks[body] = kMoving;
  }
  return marks;
}

// Marks bodies that penetrate others. They count as moving: a body that is wedged between waiting
// ones can only leave when these move, too.
ExactRest::Marks ExactRest::penetrating() const {
  Marks marks(model_.bodies.size(), kStill);
  for (const BodyContact& contact : contacts_) {
    for (const uint32_t body : {contact.a, contact.b}) {
      if (contact.distance_m < -most_depth_m(body) && is_meant(body)) marks[body] = kMoving;
    }
  }
  return marks;
}

// Lets bodies give way that hold others: bodies left as they are that a body to be made sound
// penetrates, then, where such a body already gives way, the bodies that it penetrates, and so on.
// Returns 1 for the first of these, which the solver must take.
ExactRest::Marks ExactRest::let_go() {
  std::vector<std::pair<uint32_t, uint32_t>> in;  // a body, and one that it penetrates
  for (const BodyContact& contact : contacts_) {
    for (const auto& [body, other] : {std::pair(contact.a, contact.b), {contact.b, contact.a}}) {
      const bool is_other_left = state_.left[other] == kGivesWay || state_.left[other] == kMayGo;
      if (may_move(body) && is_other_left && contact.distance_m < -most_depth_m(body)) {
        in.emplace_back(body, other);
      }
    }
  }
  std::ranges::sort(in);
  std::vector<uint32_t> pressed;
  Marks is_pressed(model_.bodies.size(), 0);
  const auto press = [&](uint32_t body) {
    if (is_pressed[body] == 0) pressed.push_back(body);
    is_pressed[body] = 1;
  };
  for (const auto& [body, other] : in) {
    if (is_meant(body)) press(other);
  }
  Marks pressed_first = is_pressed;
  for (size_t i = 0; i < pressed.size(); ++i) {
    const uint32_t body = pressed[i];
    if (state_.left[body] == kMayGo) {
      state_.left[body] = kGivesWay;
      engine_->wake(body);
      continue;
    }
    auto pair = std::ranges::lower_bound(in, body, {}, &std::pair<uint32_t, uint32_t>::first);
    for (; pair != in.end() && pair->first == body; ++pair) press(pair->second);
  }
  return pressed_first;
}

// Once all seem at rest and some bodies are left as they are, returns 1 for bodies that need work
// after all: left bodies that are now close enough to the surface to be seen, waiting bodies whose
// support is gone, and penetrating bodies if there are more of them than at best. Empty if there
// are none.
ExactRest::Marks ExactRest::overlooked(const Marks& penetrating) {
  if (count_of(state_.left) == 0) return {};
  Marks marks(state_.left.size(), 0), touched(state_.left.size(), 0);
  for (const BodyContact& contact : contacts_) {
    for (const uint32_t body : {contact.a, contact.b}) {
      if (contact.distance_m <= most_depth_m(body)) touched[body] = 1;
    }
  }
  read_states();
  const std::vector<double> depths = depths_under_surface(model_, states_);
  const double seen_m = kUncoveredDepth * mean_diameter_m(model_);
  const bool is_worse = count_of(penetrating) > state_.penetrating.fewest;
  for (uint32_t i = 0; i < marks.size(); ++i) {
    const bool is_lost = is_meant(i) && touched[i] == 0 && !engine_->is_active(i);
    const bool is_uncovered = is_free(i) && !is_meant(i) && depths[i] <= seen_m;
    const bool penetrates_again = is_worse && penetrating[i] != kStill;
    marks[i] = is_lost || is_uncovered || penetrates_again ? 1 : 0;
    if (is_uncovered) state_.left[i] = kNotLeft;
  }
  if (count_of(marks) == 0) return {};
  state_.penetrating = {};
  return marks;
}

// Returns 1 for bodies with a mark of at least `least`, and for bodies within `rings` contacts of
// them.
ExactRest::Marks ExactRest::around(const Marks& marks, uint8_t least, int rings) const {
  Marks meant(marks.size());
  std::ranges::transform(marks, meant.begin(),
                         [&](uint8_t mark) { return static_cast<uint8_t>(mark >= least); });
  for (int ring = 0; ring < rings; ++ring) {
    Marks wider = meant;
    for (const BodyContact& contact : contacts_) {
      if (!may_move(contact.a) || !may_move(contact.b)) continue;
      wider[contact.a] |= meant[contact.b];
      wider[contact.b] |= meant[contact.a];
    }
    meant = std::move(wider);
  }
  return meant;
}

// Lets all other bodies wait.
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
  statistics.potential_energy_j = potential_of_deep_j_;
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
