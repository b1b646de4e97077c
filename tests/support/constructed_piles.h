// A hand-made world under a director: nothing moves by itself.
#pragma once

#include <vector>

#include "simulate/body_control.h"
#include "support/small_model.h"

namespace pilesim {

class ConstructedWorld final : public BodyControl {
 public:
  // Bodies are at rest in the poses of the model.
  explicit ConstructedWorld(const SmallModel& small) : small_(small) {
    for (const ModelBody& body : small.model.bodies) {
      motions.push_back(
          {body.pose.position, body.pose.orientation, body.linear_velocity, body.angular_velocity});
      asleep.push_back(0);
      friction.push_back(small.model.materials[body.material].friction);
    }
  }

  // `upper` rests on `lower` on the four corners of a square below its centre.
  void rest(uint32_t upper, uint32_t lower, double height_m, double distance_m = 0) {
    for (const double x : {-0.05, 0.05}) {
      for (const double z : {-0.05, 0.05}) {
        const Vec3 below = motions[upper].position - Vec3(0, height_m, 0);
        contacts.push_back({.a = upper,
                            .b = lower,
                            .point = below + Vec3(x, 0, z),
                            .normal = Vec3::UnitY(),
                            .distance_m = distance_m});
      }
    }
  }

  // Directs this many steps.
  void step(StepDirector& director, int steps) {
    for (int i = 0; i < steps; ++i) {
      director.direct(*this);
      time += step_s();
    }
  }

  double time_s() const override { return time; }
  double step_s() const override { return small_.scene.step_s.value_or(Scene::kFixedStep); }
  bool is_in_world(uint32_t body) const override {
    return small_.model.bodies[body].role == Role::dynamic;
  }
  BodyMotion motion(uint32_t body) const override { return motions[body]; }
  void put_to_sleep(uint32_t body) override { asleep[body] = 1; }
  void wake(uint32_t body) override { asleep[body] = 0; }
  bool is_asleep(uint32_t body) const override { return asleep[body] != 0; }
  void set_velocity(uint32_t body, const Vec3& linear, const Vec3& angular) override {
    velocity_asked.resize(motions.size(), Vec3::Zero());
    velocity_asked[body] = linear;
    motions[body].angular_velocity = angular;
  }
  void set_friction(uint32_t body, double value) override { friction[body] = value; }
  void read_contacts(std::vector<BodyContact>& read) const override { read = contacts; }

  double time = 0;
  std::vector<BodyMotion> motions;
  std::vector<BodyContact> contacts;
  std::vector<uint8_t> asleep;
  std::vector<double> friction;
  std::vector<Vec3> velocity_asked;

 private:
  const SmallModel& small_;
};

}  // namespace pilesim
