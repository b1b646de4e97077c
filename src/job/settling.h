// When all that happens in a scene has happened, and all has come to rest: the end of a run with
// "until": "settled".
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "inspect/pile_inspection.h"
#include "model/model.h"
#include "simulate/body_state.h"

namespace pilesim {

// Places in the trajectory in `directory`, which holds it: at a frame before `frame`.
EarlierPlaces places_at(const std::filesystem::path& directory, uint64_t earlier, uint64_t frame);

class Settling {
 public:
  // `model` must outlive it.
  Settling(const Scene& scene, const Model& model);

  // After each frame. `quiet_frames` so far nothing has moved, this one included; it is kept by who
  // asks, as a run may be resumed. `places` gives those of a frame before: where all has been slow
  // for long enough, nothing may have crept either.
  bool is_over(uint64_t frame, const BodyStates& states, uint64_t& quiet_frames,
               const std::function<EarlierPlaces(uint64_t)>& places) const;
  // JSON object: whether all had settled by the last frame, how many bodies had not, and when.
  std::string figures(uint64_t frame, uint64_t unsettled, uint64_t quiet_frames) const;

 private:
  const Model& model_;
  Vec3 gravity_;
  double frame_rate_;
  double last_change_s_;  // of bodies that appear, events, and kinematic bodies
  double quiet_s_;        // for which all must be at rest
};

}  // namespace pilesim
