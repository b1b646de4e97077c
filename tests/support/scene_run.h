// A scene that a test builds and runs frame by frame.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <memory>
#include <string>

#include "simulate/modes/make_simulator.h"
#include "simulate/simulator.h"

namespace pilesim::test {

class SceneRun : public testing::Test {
 protected:
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

  Scene scene_;
  Model model_;
  std::unique_ptr<Simulator> simulator_;
};

}  // namespace pilesim::test
