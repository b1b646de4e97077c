// Small scenes in the mixed mode, with boxes that are particles at a distance: no signatures.
#pragma once

#include <string>

#include "support/scene_run.h"

namespace pilesim::test {

class MixedScene : public SceneRun {
 protected:
  static constexpr double kSide = 0.2;

  MixedScene() {
    scene_.name = "test";
    scene_.step_s = 1.0 / 120;
    scene_.frame_rate = 60;
    scene_.simulator.mode = SimulatorMode::mixed;
    use_level(PairMethod::particle);
    scene_.materials["stuff"] = {0.3, 0.5, 1000};
    scene_.shapes["ground"] = PlaneShape{};
    scene_.shapes["cube"] = BoxShape{{kSide, kSide, kSide}};
    scene_.shapes["brick"] = BoxShape{{0.3, 0.2, 0.1}};
    scene_.shapes["slab"] = BoxShape{{4, 0.4, 4}};
  }

  // One level: pairs near must-impulse bodies use `near`, others are particles.
  void use_level(PairMethod near) {
    scene_.simulator.detail.levels = {
        {.near_near = near, .near_far = PairMethod::particle, .far_far = PairMethod::particle}};
  }

  Body& add(const std::string& shape, const Vec3& position, Preference preference,
            Role role = Role::dynamic) {
    Body body{
        .name = shape + std::to_string(scene_.bodies.size()), .shape = shape, .material = "stuff"};
    body.pose.position = position;
    body.role = role;
    body.preference = preference;
    scene_.bodies.push_back(body);
    return scene_.bodies.back();
  }

  bool is_near(uint32_t body) const {
    return (states().flags[body] & (kStatistical | kImpulse)) == (kStatistical | kImpulse);
  }
  bool is_far(uint32_t body) const {
    return (states().flags[body] & (kStatistical | kImpulse)) == kStatistical;
  }
};

constexpr Preference kExact = Preference::must_impulse;
constexpr Preference kSphere = Preference::prefer_statistical;

}  // namespace pilesim::test
