#include "job/settling.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "simulate/lifecycle.h"
#include "trajectory/trajectory.h"

namespace pilesim {

namespace {

double last_change_of(const Model& model) {
  double last_s = 0;
  for (const ModelBody& body : model.bodies) {
    if (!body.motion.empty()) last_s = std::max(last_s, body.motion.back().time_s);
    for (const Motor& motor : body.motion.motors) {
      last_s = std::max(last_s, motor.end_s.value_or(std::numeric_limits<double>::infinity()));
    }
  }
  for (const ModelEvent& event : model.events) last_s = std::max(last_s, event.time_s);
  return last_s;
}

}  // namespace

EarlierPlaces places_at(const std::filesystem::path& directory, uint64_t earlier, uint64_t frame) {
  TrajectoryReader trajectory(directory);
  TrajectoryFrame there;
  trajectory.read(earlier, there);
  EarlierPlaces places{
      .ago_s = static_cast<double>(frame - earlier) / trajectory.header().frame_rate,
      .flags = there.state};
  for (const auto& position : there.position) {
    places.position.push_back(position);
  }
  return places;
}

Settling::Settling(const Scene& scene, const Model& model)
    : model_(model),
      gravity_(scene.gravity),
      frame_rate_(scene.frame_rate),
      last_change_s_(last_change_of(model)),
      quiet_s_(quiet_time_s(model, scene.gravity)) {}

bool Settling::is_over(uint64_t frame, const Simulator& simulator, uint64_t& quiet_frames,
                       const std::function<EarlierPlaces(uint64_t)>& places) const {
  const BodyStates& states = simulator.states();
  const double last_s = std::max(last_change_s_, simulator.life().last_start_s());
  const bool is_quiet = static_cast<double>(frame) / frame_rate_ > last_s &&
                        count_unsettled(model_, gravity_, states) == 0;
  quiet_frames = is_quiet ? quiet_frames + 1 : 0;
  if (static_cast<double>(quiet_frames) <= quiet_s_ * frame_rate_) return false;
  if (count_unsettled(model_, gravity_, states, places(frame + 1 - quiet_frames)) > 0) {
    quiet_frames = 0;
  }
  return quiet_frames > 0;
}

std::string Settling::figures(uint64_t frame, uint64_t unsettled, uint64_t quiet_frames) const {
  const bool settled = unsettled == 0 && quiet_frames > 0;
  nlohmann::ordered_json json = {{"settled", settled}, {"unsettled", unsettled}};
  if (settled) {
    json["since_s"] = static_cast<double>(frame + 1 - quiet_frames) / frame_rate_;
  }
  return json.dump();
}

}  // namespace pilesim
