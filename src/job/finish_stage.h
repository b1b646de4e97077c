// The trajectory of a directory made to end in a sound pile.
#pragma once

#include <cstdint>
#include <filesystem>

#include "core/progress.h"
#include "finish/finished_pile.h"

namespace pilesim {

struct FinishStage {
  const Scene& scene;
  const Model& model;
  std::optional<double> longest_s;  // see ExactRest
  ProgressMode progress;
};

// Reads `source`, and makes `target`, a trajectory.zarr that is not there, of it. Ctrl-C while
// bodies come to rest: all frames are written, and end where the bodies are then; while frames are
// written: there are fewer. The figures say so; `frames` gets how many there are.
FinishedPile finish_trajectory(const FinishStage& stage, const std::filesystem::path& source,
                               const BodyStates& start, const std::filesystem::path& target,
                               uint64_t& frames);

// The same for the trajectory in `directory`, which the finished one replaces; the other is kept as
// simulated.zarr until forget_simulated(). Where it is interrupted nothing is replaced.
FinishedPile finish_in_place(const FinishStage& stage, const std::filesystem::path& directory);
void forget_simulated(const std::filesystem::path& directory);
// After a kill between the two: the trajectory is again as it was simulated.
void restore_simulated(const std::filesystem::path& directory);

}  // namespace pilesim
