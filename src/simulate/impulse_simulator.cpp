#include "simulate/impulse_simulator.h"

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/error.h"
#include "simulate/exact_engine.h"
#include "simulate/kinematic_motion.h"
#include "simulate/timeline.h"

namespace pilesim {
namespace {

// Directs with what every mode offers.
class PlainDirector final : public ImpulseDirector {
 public:
  explicit PlainDirector(StepDirector& director) : director_(director) {}
  void direct(ImpulseControl& control) override { director_.direct(control); }
  void end_frame(ImpulseControl& control) override { director_.end_frame(control); }

 private:
  StepDirector& director_;
};

class ImpulseSimulator final : public Simulator, public ImpulseControl {
 public:
  // `director` may be null.
  ImpulseSimulator(const Scene& scene, const Model& model, std::unique_ptr<ExactEngine> engine,
                   ImpulseDirector* director);
  ImpulseSimulator(const Scene& scene, const Model& model, std::unique_ptr<ExactEngine> engine,
                   StepDirector& director)
      : ImpulseSimulator(scene, model, std::move(engine), nullptr) {
    director_ = &plain_.emplace(director);
  }

  FrameStatistics step_frame() override;
  const BodyStates& states() const override { return states_; }
  FrameStatistics statistics() const override;

  double time_s() const override { return time_s_; }
  double step_s() const override { return step_s_; }
  bool is_in_world(uint32_t body) const override {
    return exact_.contains(body) && model_.bodies[body].role == Role::dynamic &&
           (states_.flags[body] & kHeld) == 0;
  }
  BodyMotion motion(uint32_t body) const override { return exact_.motion(body); }
  void put_to_sleep(uint32_t body) override { exact_.put_to_sleep(body); }
  void wake(uint32_t body) override { exact_.wake(body); }
  bool is_asleep(uint32_t body) const override { return !exact_.is_active(body); }
  void set_velocity(uint32_t body, const Vec3& linear, const Vec3& angular) override {
    exact_.set_velocity(body, linear, angular);
  }
  void set_friction(uint32_t body, double friction) override {
    exact_.set_friction(body, friction);
  }
  void read_contacts(std::vector<BodyContact>& contacts) const override {
    exact_.read_contacts(contacts);
  }
  ConstraintId add_nail(const Nail& nail) override { return exact_.add_nail(nail); }
  void remove_constraint(ConstraintId constraint) override { exact_.remove_constraint(constraint); }
  bool holds(ConstraintId constraint) const override { return exact_.holds(constraint); }
  void mark(uint32_t body, uint8_t mask, uint8_t flags) override;

 private:
  void add_new_bodies();
  void add_body(uint32_t index);
  void remove_body(uint32_t index);
  void apply_impulse(uint32_t body, const ModelEvent& event);
  void bring_events();
  void move_kinematic_bodies();
  void read_states();
  void check_finite() const;
  void take_hits();

  const Scene& scene_;
  const Model& model_;
  double step_s_;
  double time_s_ = 0;   // of the state
  uint64_t steps_ = 0;  // taken since the start
  uint64_t frames_ = 0;
  Timeline timeline_;
  std::vector<uint32_t> kinematic_;  // indices
  BodyStates states_;
  StageTimer timer_;
  std::unique_ptr<ExactEngine> engine_;
  ExactEngine& exact_;
  std::optional<PlainDirector> plain_;
  ImpulseDirector* director_;
  std::vector<Hit> hits_;
};

ImpulseSimulator::ImpulseSimulator(const Scene& scene, const Model& model,
                                   std::unique_ptr<ExactEngine> engine, ImpulseDirector* director)
    : scene_(scene),
      model_(model),
      step_s_(scene.actual_step_s()),
      timeline_(model, step_s_),
      engine_(std::move(engine)),
      exact_(*engine_),
      director_(director) {
  for (uint32_t i = 0; i < model.bodies.size(); ++i) {
    const ModelBody& body = model.bodies[i];
    states_.position.push_back(body.pose.position);
    states_.orientation.push_back(body.pose.orientation);
    states_.linear_velocity.push_back(body.linear_velocity);
    states_.angular_velocity.push_back(body.angular_velocity);
    states_.flags.push_back(body.held ? uint8_t{kHeld} : uint8_t{0});
    if (body.role == Role::kinematic) kinematic_.push_back(i);
  }
  add_new_bodies();
}

void ImpulseSimulator::add_new_bodies() {
  timeline_.bring_bodies(time_s_, [&](uint32_t index) { add_body(index); });
}

void ImpulseSimulator::add_body(uint32_t index) {
  const ModelBody& source = model_.bodies[index];
  exact_.add(index,
             {source.pose.position, source.pose.orientation, states_.linear_velocity[index],
              states_.angular_velocity[index]},
             (states_.flags[index] & kHeld) != 0, source.asleep);
  states_.flags[index] |= kPresent;
  if (source.role == Role::dynamic) states_.flags[index] |= kImpulse;
}

void ImpulseSimulator::remove_body(uint32_t index) {
  states_.flags[index] &= static_cast<uint8_t>(~(kPresent | kAsleep | kImpulse));
  if (!exact_.contains(index)) return timeline_.cancel(index);
  exact_.remove(index);
}

void ImpulseSimulator::apply_impulse(uint32_t body, const ModelEvent& event) {
  if (is_in_world(body)) exact_.apply_impulse(body, event);
}

void ImpulseSimulator::bring_events() {
  timeline_.bring_events(
      time_s_, states_.flags,
      {.add = [&](uint32_t body) { add_body(body); },
       .remove = [&](uint32_t body) { remove_body(body); },
       .push = [&](uint32_t body, const ModelEvent& event) { apply_impulse(body, event); }});
}

void ImpulseSimulator::move_kinematic_bodies() {
  for (const uint32_t index : kinematic_) {
    if (!exact_.contains(index) || model_.bodies[index].motion.empty()) continue;
    exact_.move_by_keys(index, time_s_);
  }
}

FrameStatistics ImpulseSimulator::step_frame() {
  timer_.take();
  const int steps = scene_.steps_per_frame();
  for (int step = 0; step < steps; ++step) {
    add_new_bodies();
    bring_events();
    move_kinematic_bodies();
    if (director_ != nullptr) {
      director_->direct(*this);
      exact_.refresh_friction();
    }
    exact_.step(timer_, [this] { take_hits(); });
    ++steps_;
    time_s_ = static_cast<double>(steps_) * step_s_;
  }
  add_new_bodies();
  if (director_ != nullptr) director_->end_frame(*this);
  ++frames_;
  read_states();
  check_finite();
  FrameStatistics statistics = this->statistics();
  statistics.steps = steps;
  statistics.times = timer_.take();
  return statistics;
}

void ImpulseSimulator::take_hits() {
  if (director_ == nullptr) return;
  exact_.find_hits(hits_);
  if (!hits_.empty()) director_->take_hits(*this, hits_);
}

void ImpulseSimulator::read_states() {
  for (uint32_t i = 0; i < states_.size(); ++i) {
    const ModelBody& source = model_.bodies[i];
    if (!exact_.contains(i) || source.role == Role::fixed) continue;
    const BodyMotion motion = exact_.motion(i);
    if (source.role == Role::kinematic) {
      if (!source.motion.empty()) {
        const Pose pose = pose_at(model_.shapes[source.shape], source.motion, time_s_);
        states_.position[i] = pose.position;
        states_.orientation[i] = pose.orientation;
      }
    } else {
      states_.position[i] = motion.position;
      states_.orientation[i] = motion.orientation;
    }
    if ((states_.flags[i] & kHeld) == 0) {  // a held body keeps the velocities it will start with
      states_.linear_velocity[i] = motion.linear_velocity;
      states_.angular_velocity[i] = motion.angular_velocity;
    }
    const bool asleep = is_in_world(i) && !exact_.is_active(i);
    states_.flags[i] &= static_cast<uint8_t>(~kAsleep);
    if (asleep) states_.flags[i] |= kAsleep;
  }
}

void ImpulseSimulator::check_finite() const {
  for (uint32_t i = 0; i < states_.size(); ++i) {
    if (states_.position[i].allFinite() && states_.orientation[i].coeffs().allFinite() &&
        states_.linear_velocity[i].allFinite() && states_.angular_velocity[i].allFinite()) {
      continue;
    }
    throw Error(ErrorKind::input,
                Problem{.found = "body '" + model_.bodies[i].name + "' left all bounds in frame " +
                                 std::to_string(frames_),
                        .expected = "a state that stays finite",
                        .remedy = "Make step_s shorter, or look for bodies that start inside one "
                                  "another or with extreme velocities"});
  }
}

FrameStatistics ImpulseSimulator::statistics() const {
  FrameStatistics statistics;
  for (uint32_t i = 0; i < states_.size(); ++i) {
    if ((states_.flags[i] & kPresent) != 0) ++statistics.bodies_present;
    if (!is_in_world(i)) continue;
    if (exact_.is_active(i)) ++statistics.bodies_awake;
    statistics.kinetic_energy_j += exact_.kinetic_energy_j(i);
    statistics.potential_energy_j -=
        model_.bodies[i].mass_kg * scene_.gravity.dot(states_.position[i]);
  }
  exact_.add_contacts_to(statistics);
  return statistics;
}

void ImpulseSimulator::mark(uint32_t body, uint8_t mask, uint8_t flags) {
  states_.flags[body] = static_cast<uint8_t>((states_.flags[body] & ~mask) | flags);
}

}  // namespace

std::unique_ptr<Simulator> make_impulse_simulator(const Scene& scene, const Model& model,
                                                  std::unique_ptr<ExactEngine> engine) {
  return std::make_unique<ImpulseSimulator>(scene, model, std::move(engine), nullptr);
}

std::unique_ptr<Simulator> make_impulse_simulator(const Scene& scene, const Model& model,
                                                  std::unique_ptr<ExactEngine> engine,
                                                  StepDirector& director) {
  return std::make_unique<ImpulseSimulator>(scene, model, std::move(engine), director);
}

std::unique_ptr<Simulator> make_impulse_simulator(const Scene& scene, const Model& model,
                                                  std::unique_ptr<ExactEngine> engine,
                                                  ImpulseDirector& director) {
  return std::make_unique<ImpulseSimulator>(scene, model, std::move(engine), &director);
}

}  // namespace pilesim
