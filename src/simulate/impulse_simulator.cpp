#include "simulate/impulse_simulator.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "model/kinematic_motion.h"
#include "simulate/exact_engine.h"
#include "simulate/lifecycle.h"

namespace pilesim {
namespace {

// Directs with the interface that every mode offers.
class PlainDirector final : public ImpulseDirector {
 public:
  explicit PlainDirector(StepDirector& director) : director_(director) {}
  void direct(ImpulseControl& control) override { director_.direct(control); }
  void end_frame(ImpulseControl& control) override { director_.end_frame(control); }
  void save(StateWriter& writer) const override { director_.save(writer); }
  void load(StateReader& reader) override { director_.load(reader); }

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
  const BodyStates& states() const override { return life_.states(); }
  const Lifecycle& life() const override { return life_; }
  std::vector<std::string> notes() const override { return life_.notes(); }
  std::vector<uint32_t> broken_joints() const override { return exact_.broken_joints(); }
  FrameStatistics statistics() const override;

  double time_s() const override { return life_.time_s(); }
  double step_s() const override { return life_.step_s(); }
  bool is_in_world(uint32_t body) const override { return life_.is_in_world(body); }
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
  ConstraintId add_glue(const GlueSpot& spot) override { return exact_.add_glue(spot); }
  void remove_constraint(ConstraintId constraint) override { exact_.remove_constraint(constraint); }
  bool holds(ConstraintId constraint) const override { return exact_.holds(constraint); }
  void mark(uint32_t body, uint8_t mask, uint8_t flags) override;
  void save(StateWriter& writer) const override;
  void load(StateReader& reader) override;

 private:
  void add(uint32_t body);
  Pose pose_now(uint32_t body) const;
  void move_kinematic_bodies();
  int choose_step();
  void read_states();
  void take_hits();

  const Scene& scene_;
  const Model& model_;
  Lifecycle life_;
  LifeHandlers handlers_;
  std::vector<uint32_t> kinematic_;  // indices
  std::vector<double> mass_kg_;      // (B)
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
      life_(scene, model),
      handlers_{.add = [this](uint32_t body) { add(body); },
                .remove = [this](uint32_t body) { exact_.remove(body); },
                .push = [this](uint32_t body,
                               const ModelEvent& event) { exact_.apply_impulse(body, event); },
                .pose = [this](uint32_t body) { return pose_now(body); }},
      engine_(std::move(engine)),
      exact_(*engine_),
      director_(director) {
  for (uint32_t i = 0; i < model.bodies.size(); ++i) {
    if (model.bodies[i].role == Role::kinematic) kinematic_.push_back(i);
    mass_kg_.push_back(model.bodies[i].mass_kg);
  }
  life_.bring_bodies(handlers_);
}

void ImpulseSimulator::add(uint32_t body) {
  BodyStates& states = life_.states();
  const ModelBody& source = model_.bodies[body];
  exact_.add(body,
             {source.pose.position, source.pose.orientation, states.linear_velocity[body],
              states.angular_velocity[body]},
             life_.has(body, kHeld), source.asleep);
  if (source.role == Role::dynamic) states.flags[body] |= kImpulse;
}

Pose ImpulseSimulator::pose_now(uint32_t body) const {
  const ModelBody& source = model_.bodies[body];
  if (!source.motion.empty()) return pose_at(model_.shapes[source.shape], source.motion, time_s());
  const BodyMotion motion = exact_.motion(body);
  return {motion.position, motion.orientation};
}

void ImpulseSimulator::move_kinematic_bodies() {
  for (const uint32_t index : kinematic_) {
    if (!exact_.contains(index) || model_.bodies[index].motion.empty()) continue;
    exact_.move_by_keys(index, time_s());
  }
}

FrameStatistics ImpulseSimulator::step_frame() {
  timer_.take();
  life_.begin_frame();
  int steps = 0;
  for (int left = 1; left > 0; ++steps) {
    life_.bring_bodies(handlers_);
    life_.bring_events(handlers_);
    move_kinematic_bodies();
    left = choose_step();
    if (director_ != nullptr) director_->direct(*this);
    exact_.step(timer_, [this] { take_hits(); });
    life_.end_step();
    --left;
  }
  life_.end_frame();
  life_.bring_bodies(handlers_);
  if (director_ != nullptr) director_->end_frame(*this);
  read_states();
  FrameStatistics statistics = this->statistics();
  statistics.steps = steps;
  statistics.times = timer_.take();
  return statistics;
}

// Sets the length of the step to come. How many of that length the rest of the frame takes, or one
// more than the part of it takes after which a body comes or an event happens.
int ImpulseSimulator::choose_step() {
  constexpr double kRounding = 1e-6;  // a frame takes no step more for it
  const double rest_s = life_.rest_of_frame_s();
  // Directors of guides count steps.
  const bool is_fixed = scene_.step_s || scene_.guide;
  const double part_s = is_fixed ? rest_s : life_.rest_of_part_s();
  if (!is_fixed) exact_.set_step(part_s);
  const double longest_s =
      is_fixed ? scene_.actual_step_s() : exact_.longest_step_s(part_s, timer_);
  const int steps = std::max(1, static_cast<int>(std::ceil(part_s / longest_s - kRounding)));
  life_.set_step(is_fixed ? longest_s : part_s / steps);
  exact_.set_step(life_.step_s());
  return part_s < rest_s ? steps + 1 : steps;
}

void ImpulseSimulator::take_hits() {
  if (director_ == nullptr) return;
  exact_.find_hits(hits_);
  if (!hits_.empty()) director_->take_hits(*this, hits_);
}

void ImpulseSimulator::read_states() {
  BodyStates& states = life_.states();
  for (uint32_t i = 0; i < states.size(); ++i) {
    if ((states.flags[i] & kAsleep) != 0 && !exact_.is_active(i)) continue;  // as it was
    const ModelBody& source = model_.bodies[i];
    if (!exact_.contains(i) || source.role == Role::fixed) continue;
    const BodyMotion motion = exact_.motion(i);
    if (source.role == Role::kinematic) {
      if (!source.motion.empty()) {
        const Pose pose = pose_at(model_.shapes[source.shape], source.motion, time_s());
        states.position[i] = pose.position;
        states.orientation[i] = pose.orientation;
      }
    } else {
      states.position[i] = motion.position;
      states.orientation[i] = motion.orientation;
    }
    if ((states.flags[i] & kHeld) == 0) {  // a held body keeps the velocities it will start with
      states.linear_velocity[i] = motion.linear_velocity;
      states.angular_velocity[i] = motion.angular_velocity;
    }
    const bool asleep = is_in_world(i) && !exact_.is_active(i);
    states.flags[i] &= static_cast<uint8_t>(~kAsleep);
    if (asleep) states.flags[i] |= kAsleep;
    life_.check_finite(i);
  }
}

FrameStatistics ImpulseSimulator::statistics() const {
  const BodyStates& states = life_.states();
  FrameStatistics statistics;
  for (uint32_t i = 0; i < states.size(); ++i) {
    if ((states.flags[i] & kPresent) != 0) ++statistics.bodies_present;
    if (!is_in_world(i)) continue;
    if ((states.flags[i] & kAsleep) == 0 && exact_.is_active(i)) {
      ++statistics.bodies_awake;
      statistics.kinetic_energy_j += exact_.kinetic_energy_j(i);
    }
    statistics.potential_energy_j -= mass_kg_[i] * scene_.gravity.dot(states.position[i]);
  }
  exact_.add_contacts_to(statistics);
  return statistics;
}

void ImpulseSimulator::save(StateWriter& writer) const {
  life_.save(writer);
  exact_.save(writer);
  if (director_ != nullptr) director_->save(writer);
}

void ImpulseSimulator::load(StateReader& reader) {
  life_.load(reader);
  exact_.load(reader);
  for (uint32_t i = 0; i < model_.bodies.size(); ++i) {
    StateReader::require(life_.has(i, kPresent) == exact_.contains(i),
                         "each body that is present in the engine");
  }
  if (director_ != nullptr) director_->load(reader);
}

void ImpulseSimulator::mark(uint32_t body, uint8_t mask, uint8_t flags) {
  BodyStates& states = life_.states();
  states.flags[body] = static_cast<uint8_t>((states.flags[body] & ~mask) | flags);
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
