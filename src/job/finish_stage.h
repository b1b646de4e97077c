// Changes the trajectory of a directory so that it ends in a sound pile.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "core/checkpoint_file.h"
#include "core/pile_quality.h"
#include "core/progress.h"
#include "finish/finished_pile.h"

namespace pilesim {

// The checkpoint beside the trajectory while its pile comes to rest.
inline constexpr char kFinishingFile[] = "finishing.bin";

RestSettings settings_of(const Finish& finish);

// Whether a run ends with finishing. Where the mode decides and too many of the bodies still move
// to be brought to rest unseen, it does not, and `note` says so.
bool is_to_be_finished(const Scene& scene, uint64_t bodies, uint64_t unsettled, std::string& note);

struct FinishStage {
  const Scene& scene;
  const Model& model;
  RestSettings settings;
  ProgressMode progress;
  CheckpointKey key;           // identifies the pile and the settings
  double checkpoint_period_s;  // least wall time between checkpoints
};

// Reads `source` and writes the new trajectory `directory`/`name`. Continues from a checkpoint in
// `directory`, or starts and writes checkpoints. After Ctrl-C while bodies come to rest, it writes
// all frames, and they end at the bodies' present poses; while frames are written, it stops early.
// The figures say so; `frames` receives the number written. Throws Error(input) if the checkpoint
// belongs to other work.
FinishedPile finish_trajectory(const FinishStage& stage, const std::filesystem::path& source,
                               const BodyStates& start, const std::filesystem::path& directory,
                               const std::string& name, uint64_t& frames);

// The same for the trajectory in `directory`: the finished one replaces it, and the original is
// kept as simulated.zarr. An interruption replaces nothing.
FinishedPile finish_in_place(const FinishStage& stage, const std::filesystem::path& directory);
// The gates judge finished bodies: in this pile, bodies left as they are count as fixed. Sets the
// figures of those bodies.
PileQuality inspect_finished(const Scene& scene, const Model& model, FinishedPile& pile);
// A line for people about the resumption.
std::string resumed_after(const FinishedPile& pile);
// Removes the files that only an unfinished job needs; call it after everything is written.
void forget_finishing(const std::filesystem::path& directory);
// Restores the simulated trajectory after a kill before forget_finishing().
void restore_simulated(const std::filesystem::path& directory);

}  // namespace pilesim
