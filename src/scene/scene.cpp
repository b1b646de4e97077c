#include "scene/scene.h"

#include <cmath>

namespace pilesim {

namespace {
// Products such as 7 s * 60 Hz must not lose or win a frame to rounding.
constexpr double kRoundingSlack = 1e-6;
}  // namespace

int Scene::frame_count() const {
  return 1 + static_cast<int>(std::floor(duration_s * frame_rate + kRoundingSlack));
}

int Scene::steps_per_frame() const {
  return std::max(1, static_cast<int>(std::ceil(1.0 / (frame_rate * step_s) - kRoundingSlack)));
}

std::string mode_name(SimulatorMode mode) {
  return mode == SimulatorMode::impulse ? "impulse" : "statistical";
}

}  // namespace pilesim
