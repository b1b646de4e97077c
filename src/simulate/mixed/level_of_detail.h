// Selects each body's level of detail from the camera's view of it (dissertation 4.3).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/state_stream.h"
#include "model/model.h"
#include "scene/scene.h"
#include "simulate/body_state.h"

namespace pilesim {

// A camera's view, with the measures that select levels.
class Viewpoint {
 public:
  Viewpoint(const CameraKey& key, double aspect);
  double distance_m(const Vec3& point) const { return (point - eye_).norm(); }
  // The diameter of a sphere relative to the picture's height; infinite if the eye is inside it.
  double screen_size(const Vec3& centre, double radius_m) const;
  bool sees(const Vec3& centre, double radius_m) const;

 private:
  Vec3 eye_, forward_, right_, up_;
  double tan_half_width_, tan_half_height_;
};

// The level from 0 of a value among ascending limits (level i ends at limits[i]), given its
// previous `level`: a limit changes the level only when exceeded by the share `hysteresis`.
uint32_t level_among(double value, std::span<const double> limits, double hysteresis,
                     uint32_t level);

// The view at `time_s` of the scene's picture. The scene must have a camera.
Viewpoint viewpoint(const Scene& scene, double time_s);

class LevelSelector {
 public:
  // Both arguments must outlive it.
  LevelSelector(const Scene& scene, const Model& model);

  // True if some rule depends on the state, so that levels may change.
  bool is_variable() const;
  // Chooses the levels of `bodies`, from 0, for the state at `time_s`.
  void choose(double time_s, const BodyStates& states, std::span<const uint32_t> bodies);
  uint32_t level(uint32_t body) const { return levels_[body]; }

  void save(StateWriter& writer) const { writer(choices_, levels_); }
  void load(StateReader& reader);

 private:
  // The previous choice, by rule.
  struct Choice {
    uint8_t distance = 0, size = 0, speed = 0;
    bool outside = false, is_known = false;

    static void fields(auto& self, auto& stream) {
      stream(self.distance, self.size, self.speed, self.outside, self.is_known);
    }
  };
  uint32_t level_of(uint32_t body, const BodyStates& states, const Viewpoint* view);

  const Scene& scene_;
  const Model& model_;
  const LevelOfDetail& detail_;
  std::vector<double> size_limits_;  // for 1 / size, ascending
  std::vector<Choice> choices_;
  std::vector<uint8_t> levels_;
};

}  // namespace pilesim
