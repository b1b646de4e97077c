#include "simulate/mixed/mixed_figures.h"

#include <algorithm>
#include <nlohmann/json.hpp>

namespace pilesim {

MixedFigures::MixedFigures(const Scene& scene, const Model& model)
    : scene_(scene), model_(model), level_frames_(scene.simulator.detail.levels.size()) {
  for (uint32_t i = 0; i < model.bodies.size(); ++i) {
    const ModelBody& body = model.bodies[i];
    if (body.role == Role::dynamic && body.preference == Preference::must_impulse) {
      exact_.push_back(i);
    }
  }
}

double MixedFigures::kinetic_energy_j(uint32_t body, const BodyMotion& motion) const {
  const ModelShape& shape = model_.shapes[model_.bodies[body].shape];
  const double mass_kg = model_.bodies[body].mass_kg;
  const Vec3 turn_rate = motion.orientation.conjugate() * motion.angular_velocity;
  const double density = mass_kg / shape.mass.volume_m3;
  return 0.5 * mass_kg * motion.linear_velocity.squaredNorm() +
         0.5 * density * turn_rate.dot(shape.mass.inertia_m5 * turn_rate);
}

double MixedFigures::energy_j(uint32_t body, const BodyMotion& motion) const {
  return kinetic_energy_j(body, motion) -
         model_.bodies[body].mass_kg * scene_.gravity.dot(motion.position);
}

double MixedFigures::exact_energy_j(const ExactEngine& world) const {
  double energy = 0;
  for (const uint32_t body : exact_) {
    if (world.contains(body)) energy += energy_j(body, world.motion(body));
  }
  return energy;
}

void MixedFigures::begin_exact_step(const ExactEngine& world, std::span<const uint32_t> entered) {
  if (!entered.empty()) before_j_ = exact_energy_j(world);
}

void MixedFigures::end_exact_step(const ExactEngine& world, std::span<const uint32_t> shared,
                                  const std::function<BodyMotion(size_t)>& handed,
                                  std::span<const uint32_t> entered) {
  if (entered.empty()) return;
  for (size_t i = 0; i < shared.size(); ++i) before_j_ += energy_j(shared[i], handed(i));
  double after_j = exact_energy_j(world);
  for (const uint32_t body : shared) after_j += energy_j(body, world.motion(body));
  largest_rise_j_ = std::max(largest_rise_j_, after_j - before_j_);
  entries_ += entered.size();
  world.read_contacts(contacts_);
  for (const BodyContact& contact : contacts_) {
    if (-contact.distance_m <= deepest_entry_m_) continue;
    if (std::ranges::binary_search(entered, contact.a) ||
        std::ranges::binary_search(entered, contact.b)) {
      deepest_entry_m_ = -contact.distance_m;
    }
  }
}

void MixedFigures::count_frame(const BodyStates& states,
                               const std::function<uint32_t(uint32_t)>& level) {
  ++frames_;
  uint64_t near = 0;
  for (uint32_t i = 0; i < states.size(); ++i) {
    if ((states.flags[i] & kPresent) == 0 || (states.flags[i] & kStatistical) == 0) continue;
    ++body_frames_;
    ++level_frames_[level(i)];
    if ((states.flags[i] & kImpulse) != 0) ++near;
    if ((states.flags[i] & kAsleep) != 0) ++asleep_frames_;
  }
  near_frames_ += near;
  most_near_ = std::max(most_near_, near);
}

// Counts the displacement that no velocity explains, whenever in the step it changed, and the
// change of velocity that gravity does not explain.
void MixedFigures::count_switch(const BodyMotion& before, const BodyMotion& after) {
  const double dt = scene_.actual_step_s();
  const Vec3 mean = (before.linear_velocity + after.linear_velocity) / 2;
  const double change = (after.linear_velocity - before.linear_velocity).norm();
  const double apart_m = (after.position - before.position - dt * mean).norm();
  const double place_m = std::max(0.0, apart_m - dt * change / 2);
  const double speed =
      (after.linear_velocity - before.linear_velocity - dt * scene_.gravity).norm();
  ++switches_;
  place_jump_m_ += place_m;
  most_place_jump_m_ = std::max(most_place_jump_m_, place_m);
  speed_jump_ += speed;
  most_speed_jump_ = std::max(most_speed_jump_, speed);
}

std::string MixedFigures::json() const {
  using Json = nlohmann::ordered_json;
  const auto share = [&](uint64_t part) {
    return body_frames_ > 0 ? static_cast<double>(part) / static_cast<double>(body_frames_) : 0;
  };
  Json levels = Json::array();
  for (const uint64_t frames : level_frames_) levels.push_back(share(frames));
  Json figures = {{"share_near_exact", share(near_frames_)},
                  {"most_near_exact", most_near_},
                  {"share_asleep", share(asleep_frames_)},
                  {"share_of_levels", levels},
                  {"entries", entries_},
                  {"deepest_overlap_at_entry_m", deepest_entry_m_},
                  {"largest_energy_rise_at_entry_j", largest_rise_j_}};
  if (switches_ > 0) {
    const auto switches = static_cast<double>(switches_);
    figures["switches"] = {{"count", switches_},
                           {"mean_place_jump_m", place_jump_m_ / switches},
                           {"largest_place_jump_m", most_place_jump_m_},
                           {"mean_speed_jump_m_s", speed_jump_ / switches},
                           {"largest_speed_jump_m_s", most_speed_jump_}};
  }
  return figures.dump();
}

}  // namespace pilesim
