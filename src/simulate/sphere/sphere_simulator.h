// The simulator around a sphere engine: which bodies are in the world and when, kinematic bodies,
// and states for other parts. `World` is SphereWorld, or DrawnWorld for the dissertation's method.
#pragma once

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "core/parallel_for.h"
#include "model/kinematic_motion.h"
#include "simulate/lifecycle.h"
#include "simulate/simulator.h"
#include "simulate/sphere/body_signature.h"
#include "simulate/sphere/sphere_model.h"

namespace pilesim {

SphereWorldSettings sphere_world_settings(const Scene& scene);
// Throws Error(input) for a hinge, or a material with rolling friction.
void refuse_what_spheres_lack(const Model& model);

template <class World>
class SphereSimulator final : public Simulator {
 public:
  // `scene` and `model` must outlive it. Throws Error(input) for features that spheres lack: see
  // refuse_what_spheres_lack().
  SphereSimulator(const Scene& scene, const Model& model, BodySignatures objects)
      : scene_(scene),
        model_(model),
        life_(scene, model),
        handlers_{.add = [this](uint32_t body) { add(body); },
                  .remove = [this](uint32_t body) { remove(body); },
                  .push =
                      [this](uint32_t body, const ModelEvent& event) {
                        world_.push(body, event.impulse, event.point);
                      },
                  .pose = [this](uint32_t body) { return pose_now(body); }},
        objects_(std::move(objects)),
        world_(model, objects_, sphere_world_settings(scene)) {
    refuse_what_spheres_lack(model);
    for (uint32_t i = 0; i < model.bodies.size(); ++i) {
      const ModelBody& body = model.bodies[i];
      if (body.role == Role::kinematic && !body.motion.empty()) moving_surfaces_.push_back(i);
      if (body.surface_velocity) running_surfaces_.push_back(i);
    }
    life_.bring_bodies(handlers_);
  }

  FrameStatistics step_frame() override;
  const BodyStates& states() const override { return life_.states(); }
  const Lifecycle& life() const override { return life_; }
  std::vector<std::string> notes() const override { return life_.notes(); }
  FrameStatistics statistics() const override;
  std::vector<std::string> signatures() const override {
    return describe_signatures(model_, objects_);
  }
  void save(StateWriter& writer) const override {
    life_.save(writer);
    world_.save(writer);
  }
  void load(StateReader& reader) override {
    life_.load(reader);
    world_.load(reader);
    for (uint32_t i = 0; i < model_.bodies.size(); ++i) {
      const bool is_member = std::ranges::binary_search(world_.members(), i);
      StateReader::require(is_member == life_.is_in_world(i), "each body that is in the world");
    }
  }

 private:
  void add(uint32_t body);
  void remove(uint32_t body);
  Pose pose_now(uint32_t body) const;
  void move_kinematic_bodies();
  void read_states();
  void read_state(uint32_t body);

  const Scene& scene_;
  const Model& model_;
  Lifecycle life_;
  LifeHandlers handlers_;
  BodySignatures objects_;
  std::vector<uint32_t> moving_surfaces_;   // bodies
  std::vector<uint32_t> running_surfaces_;  // those with a surface velocity
  World world_;
  StageTimer timer_;
  static constexpr size_t kBodiesPerTask = 2048;
};

template <class World>
void SphereSimulator<World>::add(uint32_t body) {
  BodyStates& states = life_.states();
  const Pose pose{states.position[body], states.orientation[body]};
  if (life_.is_free(body)) {
    states.flags[body] |= kStatistical;
    world_.add(body, pose, states.linear_velocity[body], states.angular_velocity[body],
               model_.bodies[body].asleep);
  } else {
    world_.surfaces().place(body, pose, Vec3::Zero(), Vec3::Zero());
  }
}

template <class World>
void SphereSimulator<World>::remove(uint32_t body) {
  if (life_.is_free(body)) {
    world_.remove(body);
  } else {
    world_.wake_near(body);
    world_.surfaces().remove(body);
  }
}

template <class World>
Pose SphereSimulator<World>::pose_now(uint32_t body) const {
  const BodyStates& states = life_.states();
  if (!life_.is_free(body)) return {states.position[body], states.orientation[body]};
  const auto& sphere = world_.body(body);
  return {sphere.position.template cast<double>(),
          sphere.orientation.template cast<double>().normalized()};
}

template <class World>
void SphereSimulator<World>::move_kinematic_bodies() {
  BodyStates& states = life_.states();
  const double step_s = life_.step_s();
  for (const uint32_t i : moving_surfaces_) {
    const ModelBody& body = model_.bodies[i];
    if (!life_.has(i, kPresent)) continue;
    const ModelShape& shape = model_.shapes[body.shape];
    const Pose now = pose_at(shape, body.motion, life_.time_s());
    const Pose then = pose_at(shape, body.motion, life_.time_s() + step_s);
    const Vec3 velocity = (then.position - now.position) / step_s;
    const Vec3 turn_rate = turn_between(now.orientation, then.orientation) / step_s;
    world_.surfaces().place(i, now, velocity, turn_rate);
    if (!velocity.isZero() || !turn_rate.isZero()) world_.wake_near(i);
    states.position[i] = then.position;
    states.orientation[i] = then.orientation;
    states.linear_velocity[i] = velocity;
    states.angular_velocity[i] = turn_rate;
  }
  for (const uint32_t i : running_surfaces_) {
    if (life_.has(i, kPresent)) world_.wake_near(i);
  }
}

template <class World>
FrameStatistics SphereSimulator<World>::step_frame() {
  timer_.take();
  life_.begin_frame();
  const int steps = scene_.steps_per_frame();
  for (int step = 0; step < steps; ++step) {
    life_.bring_bodies(handlers_);
    life_.bring_events(handlers_);
    move_kinematic_bodies();
    world_.step(timer_);
    life_.end_step();
  }
  life_.end_frame();
  read_states();
  life_.bring_bodies(handlers_);
  FrameStatistics statistics = this->statistics();
  statistics.steps = steps;
  statistics.times = timer_.take();
  return statistics;
}

template <class World>
void SphereSimulator<World>::read_states() {
  parallel_for(world_.active().size(), kBodiesPerTask, [&](size_t begin, size_t end) {
    for (size_t k = begin; k < end; ++k) read_state(world_.active()[k]);
  });
  for (const uint32_t i : world_.active()) life_.check_finite(i);
}

template <class World>
void SphereSimulator<World>::read_state(uint32_t i) {
  BodyStates& states = life_.states();
  auto& body = world_.body(i);
  if (!body.changed) return;
  body.changed = false;
  states.position[i] = body.position.template cast<double>();
  states.orientation[i] = body.orientation.template cast<double>().normalized();
  states.linear_velocity[i] = body.velocity.template cast<double>();
  states.angular_velocity[i] = body.spin.template cast<double>();
  states.flags[i] &= static_cast<uint8_t>(~kAsleep);
  if (body.asleep) states.flags[i] |= kAsleep;
}

template <class World>
FrameStatistics SphereSimulator<World>::statistics() const {
  const BodyStates& states = life_.states();
  FrameStatistics statistics;
  for (const uint8_t flags : states.flags) {
    if ((flags & kPresent) != 0) ++statistics.bodies_present;
  }
  for (const uint32_t i : world_.active()) {
    const auto& body = world_.body(i);
    if (body.asleep) continue;
    const SphereKind& kind = world_.kind(i);
    const double k = kind.object->gyration_m;
    const Vec3f spin = kind.object->spin_of(body.orientation, body.spin);
    ++statistics.bodies_awake;
    statistics.kinetic_energy_j +=
        0.5 * kind.mass_kg * (body.velocity.squaredNorm() + k * k * spin.squaredNorm());
  }
  // Sum chunks in order, so that the result does not depend on threads.
  const std::vector<uint32_t>& members = world_.members();
  std::vector<double> potential_j(members.size() / kBodiesPerTask + 1);
  parallel_for(members.size(), kBodiesPerTask, [&](size_t begin, size_t end) {
    double sum_j = 0;
    for (size_t k = begin; k < end; ++k) {
      sum_j -= world_.kind(members[k]).mass_kg * scene_.gravity.dot(states.position[members[k]]);
    }
    potential_j[begin / kBodiesPerTask] = sum_j;
  });
  for (const double sum_j : potential_j) statistics.potential_energy_j += sum_j;
  statistics.contacts = world_.contact_count();
  statistics.deepest_penetration_m = world_.deepest_penetration_m();
  return statistics;
}

}  // namespace pilesim
