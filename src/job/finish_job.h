// The pile of a run made sound, as another run: the whole of `pilesim finish`.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/progress.h"
#include "job/simulation_job.h"
#include "report/quality_gate.h"

namespace pilesim {

struct FinishJob {
  std::filesystem::path input;  // a directory that simulate, direct-pile or finish wrote
  std::filesystem::path output;
  // The scene file of the run, beside which its meshes are; none: where it was when it ran.
  std::optional<std::filesystem::path> scene_file;
  bool force = false;
  std::optional<double> longest_s;  // in place of the scene's
  std::vector<QualityGate> gates;
  uint64_t inspect_every = 0;  // frames; 0: the end only
  ProgressMode progress = ProgressMode::automatic;
};

// Reads and checks all before `output` is touched. Ctrl-C while bodies come to rest: the pile as
// far as it is then is written; while frames are written: those that are. Either is a valid run
// that says so, and Error(interrupted) is thrown. A gate that fails throws Error(quality), with all
// written.
SimulationSummary run_finish(const FinishJob& job);

}  // namespace pilesim
