#include "simulate/mixed/level_of_detail.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "core/parallel_for.h"
#include "scene/camera_path.h"

namespace pilesim {

Viewpoint::Viewpoint(const CameraKey& key, double aspect)
    : eye_(key.position),
      forward_((key.target - key.position).normalized()),
      tan_half_width_(aspect * std::tan(key.field_of_view / 2)),
      tan_half_height_(std::tan(key.field_of_view / 2)) {
  const bool upright = std::abs(forward_.y()) < 1 - 1e-9;
  right_ = forward_.cross(upright ? Vec3::UnitY() : Vec3::UnitZ()).normalized();
  up_ = right_.cross(forward_);
}

double Viewpoint::screen_size(const Vec3& centre, double radius_m) const {
  const double distance = distance_m(centre);
  if (distance <= radius_m) return std::numeric_limits<double>::infinity();
  return radius_m / (distance * tan_half_height_);
}

bool Viewpoint::sees(const Vec3& centre, double radius_m) const {
  const Vec3 to = centre - eye_;
  const double depth = forward_.dot(to);
  if (depth < -radius_m) return false;
  const auto inside = [&](double aside, double tangent) {
    return std::abs(aside) - depth * tangent <= radius_m * std::hypot(1, tangent);
  };
  return inside(right_.dot(to), tan_half_width_) && inside(up_.dot(to), tan_half_height_);
}

Viewpoint viewpoint(const Scene& scene, double time_s) {
  const auto& [width, height] = scene.render.size;
  return {camera_at(scene.camera, time_s), static_cast<double>(width) / height};
}

uint32_t level_among(double value, std::span<const double> limits, double hysteresis,
                     uint32_t level) {
  while (level < limits.size() && value > limits[level] * (1 + hysteresis)) ++level;
  while (level > 0 && value < limits[level - 1] * (1 - hysteresis)) --level;
  return level;
}

LevelSelector::LevelSelector(const Scene& scene, const Model& model)
    : scene_(scene),
      model_(model),
      detail_(scene.simulator.detail),
      choices_(model.bodies.size()),
      levels_(model.bodies.size(), static_cast<uint8_t>(detail_.level - 1)) {
  for (const double size : detail_.screen_sizes) size_limits_.push_back(1 / size);
}

bool LevelSelector::is_variable() const {
  return !detail_.distances_m.empty() || !detail_.screen_sizes.empty() || !detail_.speeds.empty() ||
         detail_.out_of_view.has_value();
}

void LevelSelector::choose(double time_s, const BodyStates& states,
                           std::span<const uint32_t> bodies) {
  if (!is_variable()) return;
  std::optional<Viewpoint> view;
  if (!scene_.camera.keys.empty()) view = viewpoint(scene_, time_s);
  parallel_for(bodies.size(), 1024, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      levels_[bodies[i]] =
          static_cast<uint8_t>(level_of(bodies[i], states, view ? &*view : nullptr));
    }
  });
}

uint32_t LevelSelector::level_of(uint32_t body, const BodyStates& states, const Viewpoint* view) {
  Choice& choice = choices_[body];
  // A body without a previous level has no hysteresis.
  const double hysteresis = choice.is_known ? detail_.hysteresis : 0;
  choice.is_known = true;
  const auto by = [&](uint8_t& level, double value, std::span<const double> limits) {
    level = static_cast<uint8_t>(level_among(value, limits, hysteresis, level));
    return uint32_t{level};
  };
  const Vec3& centre = states.position[body];
  const double radius = model_.shapes[model_.bodies[body].shape].bounding_radius;
  uint32_t level = static_cast<uint32_t>(detail_.level - 1);
  level = std::max(level, by(choice.speed, states.linear_velocity[body].norm(), detail_.speeds));
  if (view == nullptr) return level;
  level = std::max(level, by(choice.distance, view->distance_m(centre), detail_.distances_m));
  level = std::max(level, by(choice.size, 1 / view->screen_size(centre, radius), size_limits_));
  if (!detail_.out_of_view) return level;
  choice.outside = !view->sees(centre, radius * (choice.outside ? 1 : 1 + hysteresis));
  return choice.outside ? std::max(level, static_cast<uint32_t>(*detail_.out_of_view - 1)) : level;
}

void LevelSelector::load(StateReader& reader) {
  reader(choices_, levels_);
  StateReader::require(
      choices_.size() == model_.bodies.size() && levels_.size() == model_.bodies.size(),
      "a level for each body");
  for (const uint8_t level : levels_) {
    StateReader::require(level < detail_.levels.size(), "a level of the scene");
  }
  for (const Choice& choice : choices_) {
    StateReader::require(choice.distance <= detail_.distances_m.size() &&
                             choice.size <= size_limits_.size() &&
                             choice.speed <= detail_.speeds.size(),
                         "a level of the scene");
  }
}

}  // namespace pilesim
