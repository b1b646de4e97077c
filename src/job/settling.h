// Detects that a scene has no further events and all bodies are at rest: the end of a run with
// "until": "settled".
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "inspect/pile_inspection.h"
#include "model/model.h"
#include "simulate/simulator.h"

namespace pilesim {

// Positions in `directory`'s trajectory at frame `earlier`, as seen at frame `frame`.
EarlierPlaces places_at(const std::filesystem::path& directory, uint64_t earlier, uint64_t frame);

class Settling {
 public:
  // `model` must outlive it.
  Settling(const Scene& scene, const Model& model);

  // Call it after each frame. `quiet_frames` counts consecutive frames without motion, including
  // this one; the caller keeps it, since a run may be resumed. `places` gives the positions at an
  // earlier frame: after enough slow frames, no body may have crept either.
  bool is_over(uint64_t frame, const Simulator& simulator, uint64_t& quiet_frames,
               const std::function<EarlierPlaces(uint64_t)>& places) const;
  // JSON object: whether all bodies had settled by the last frame, how many had not, and when.
  std::string figures(uint64_t frame, uint64_t unsettled, uint64_t quiet_frames) const;

 private:
  const Model& model_;
  Vec3 gravity_;
  double frame_rate_;
  double last_change_s_;  // time of the last event or kinematic motion
  double quiet_s_;        // time for which all must be at rest
};

}  // namespace pilesim
