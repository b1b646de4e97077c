#include "scene/scene.h"

#include <cmath>

namespace pilesim {

namespace {
// Products such as 7 s * 60 Hz must not lose or win a frame to rounding.
constexpr double kRoundingSlack = 1e-6;
}  // namespace

bool is_uniform(const Vec3& scale) { return scale == Vec3::Constant(scale.x()) && scale.x() > 0; }

int Scene::frame_count() const {
  return 1 + static_cast<int>(std::floor(duration_s * frame_rate + kRoundingSlack));
}

int Scene::steps_per_frame() const {
  return std::max(1, static_cast<int>(std::ceil(1.0 / (frame_rate * step_s.value_or(kFixedStep)) -
                                                kRoundingSlack)));
}

bool Scene::finishes_by_mode() const {
  const bool overlaps =
      simulator.mode == SimulatorMode::statistical || simulator.mode == SimulatorMode::mixed;
  const bool is_directed = guide || !piles.empty();
  return finish.when == Finishing::by_mode && overlaps && simulator.method == Method::own &&
         !is_directed;
}

std::string mode_name(SimulatorMode mode) {
  switch (mode) {
    case SimulatorMode::impulse:
      return "impulse";
    case SimulatorMode::statistical:
      return "statistical";
    case SimulatorMode::particle:
      return "particle";
    case SimulatorMode::mixed:
      return "mixed";
  }
  return "";
}

std::vector<DetailLevel> LevelOfDetail::table_4_1() {
  using enum PairMethod;
  return {{impulse, statistical, statistical},
          {statistical, statistical, statistical},
          {particle, particle, particle}};
}

}  // namespace pilesim
