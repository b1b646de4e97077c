// The trajectory of a directory made to end in a sound pile.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "core/checkpoint_file.h"
#include "core/pile_quality.h"
#include "core/progress.h"
#include "finish/finished_pile.h"

namespace pilesim {

// Beside the trajectory while its pile comes to rest: where that stands.
inline constexpr char kFinishingFile[] = "finishing.bin";

RestSettings settings_of(const Finish& finish);

struct FinishStage {
  const Scene& scene;
  const Model& model;
  RestSettings settings;
  ProgressMode progress;
  CheckpointKey key;           // what the pile and how it is finished are known by
  double checkpoint_period_s;  // wall time between checkpoints, at least
};

// Reads `source`, and makes `directory`/`name`, a trajectory that is not there, of it. Goes on from
// the checkpoint in `directory` where there is one, else begins and writes them. Ctrl-C while
// bodies come to rest: all frames are written, and end where the bodies are then; while frames are
// written: there are fewer. The figures say so; `frames` gets how many there are. Throws
// Error(input) where the checkpoint is of something else.
FinishedPile finish_trajectory(const FinishStage& stage, const std::filesystem::path& source,
                               const BodyStates& start, const std::filesystem::path& directory,
                               const std::string& name, uint64_t& frames);

// The same for the trajectory in `directory`, which the finished one replaces; the other is kept as
// simulated.zarr. Where it is interrupted nothing is replaced.
FinishedPile finish_in_place(const FinishStage& stage, const std::filesystem::path& directory);
// The gates judge finished bodies: in this pile those left are as fixed as the ground. Sets the
// figures of those left.
PileQuality inspect_finished(const Scene& scene, const Model& model, FinishedPile& pile);
// For people: where it went on.
std::string resumed_after(const FinishedPile& pile);
// When all is written: removes files that are of use only while a pile is finished.
void forget_finishing(const std::filesystem::path& directory);
// After a kill before that: the trajectory is again as it was simulated.
void restore_simulated(const std::filesystem::path& directory);

}  // namespace pilesim
