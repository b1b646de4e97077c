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
  // Go on where the finishing into `output` stopped; begin where nothing is there. Not with
  // `force`.
  bool resume = false;
  double checkpoint_period_s = 5;   // wall time between checkpoints, at least
  std::optional<double> longest_s;  // in place of the scene's
  bool visible_only = false;        // or the scene says so
  std::vector<QualityGate> gates;
  uint64_t inspect_every = 0;  // frames; 0: the end only
  bool picture = false;        // of the end, in report.html
  ProgressMode progress = ProgressMode::automatic;
};

// Reads and checks all before `output` is touched. Ctrl-C while bodies come to rest: the pile as
// far as it is then is written; while frames are written: those that are. Either is a valid run
// that says so, and Error(interrupted) is thrown. An interrupted or killed run is resumed, and ends
// with the same bytes but for times: Error(usage) where there is nothing to resume, Error(input)
// where the state there is that of another run, scene, program or other options. A gate that fails
// throws Error(quality), with all written.
SimulationSummary run_finish(const FinishJob& job);

}  // namespace pilesim
