// Small scenes in the mixed mode, of boxes that are particles at a distance: no signatures.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "simulate/simulator.h"

namespace pilesim::test {

class MixedScene : public testing::Test {
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

  // One level, where pairs near must-impulse bodies are treated by `near` and others as particles.
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

  Emitter& add_grid(const std::string& shape, const std::array<int, 3>& count, const Vec3& spacing,
                    const Vec3& centre) {
    Emitter emitter{.name = "grid", .shapes = {shape}, .material = "stuff"};
    emitter.source = GridSource{centre, count, spacing};
    emitter.position_jitter_m = 0.02;
    scene_.emitters.push_back(emitter);
    return scene_.emitters.back();
  }

  void start() {
    model_ = build_model(scene_);
    simulator_ = make_simulator(scene_, model_);
  }
  FrameStatistics run(int frames) {
    FrameStatistics statistics;
    for (int i = 0; i < frames; ++i) statistics = simulator_->step_frame();
    return statistics;
  }
  const BodyStates& states() const { return simulator_->states(); }
  bool is_near(uint32_t body) const {
    return (states().flags[body] & (kStatistical | kImpulse)) == (kStatistical | kImpulse);
  }
  bool is_far(uint32_t body) const {
    return (states().flags[body] & (kStatistical | kImpulse)) == kStatistical;
  }

  Scene scene_;
  Model model_;
  std::unique_ptr<Simulator> simulator_;
};

constexpr Preference kExact = Preference::must_impulse;
constexpr Preference kSphere = Preference::prefer_statistical;

}  // namespace pilesim::test
