#include "job/settling.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "inspect/pile_inspection.h"

namespace pilesim {

namespace {

// What is slow for this time, in sqrt(r / g) of the largest body, is not at the top of a bounce.
constexpr double kQuietTime = 3;

double last_change_of(const Model& model) {
  double last_s = 0;
  for (const ModelBody& body : model.bodies) {
    last_s = std::max(last_s, body.start_s);
    if (!body.motion.empty()) last_s = std::max(last_s, body.motion.back().time_s);
  }
  for (const ModelEvent& event : model.events) last_s = std::max(last_s, event.time_s);
  return last_s;
}

double largest_radius_m(const Model& model) {
  double radius = 0;
  for (const ModelBody& body : model.bodies) {
    if (body.role == Role::dynamic) {
      radius = std::max(radius, model.shapes[body.shape].bounding_radius);
    }
  }
  return radius;
}

}  // namespace

Settling::Settling(const Scene& scene, const Model& model)
    : model_(model),
      gravity_(scene.gravity),
      frame_rate_(scene.frame_rate),
      last_change_s_(last_change_of(model)) {
  const double gravity = gravity_.norm();
  quiet_s_ = gravity > 0 ? kQuietTime * std::sqrt(largest_radius_m(model) / gravity) : 0;
}

bool Settling::is_over(uint64_t frame, const BodyStates& states, uint64_t& quiet_frames) const {
  const bool is_quiet = static_cast<double>(frame) / frame_rate_ > last_change_s_ &&
                        count_unsettled(model_, gravity_, states) == 0;
  quiet_frames = is_quiet ? quiet_frames + 1 : 0;
  return static_cast<double>(quiet_frames) > quiet_s_ * frame_rate_;
}

std::string Settling::figures(uint64_t frame, const BodyStates& states,
                              uint64_t quiet_frames) const {
  const uint64_t unsettled = count_unsettled(model_, gravity_, states);
  nlohmann::ordered_json json = {{"settled", quiet_frames > 0}, {"unsettled", unsettled}};
  if (quiet_frames > 0) {
    json["since_s"] = static_cast<double>(frame + 1 - quiet_frames) / frame_rate_;
  }
  return json.dump();
}

}  // namespace pilesim
