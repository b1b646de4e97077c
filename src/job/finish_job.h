// Makes the pile of a run sound, as another run: the whole of `pilesim finish`.
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
  std::filesystem::path input;  // output directory of simulate, direct-pile or finish
  std::filesystem::path output;
  // The run's scene file, with its meshes beside it; none: its place when it ran.
  std::optional<std::filesystem::path> scene_file;
  bool force = false;
  // Continue an earlier `finish` into `output`, or begin if there is none. Excludes `force`.
  bool resume = false;
  double checkpoint_period_s = 5;   // least wall time between checkpoints
  std::optional<double> longest_s;  // overrides the scene's
  bool visible_only = false;        // set here or by the scene
  std::vector<QualityGate> gates;
  uint64_t inspect_every = 0;  // frames between inspections; 0: only at the end
  bool picture = false;        // draw the end into report.html
  ProgressMode progress = ProgressMode::automatic;
};

// Reads and checks everything before it changes `output`. After Ctrl-C while bodies come to rest,
// it writes the pile as it is; while frames are written, it keeps those written. Either is a valid
// run that says so, and Error(interrupted) is thrown. An interrupted or killed run can be resumed
// and ends with the same bytes except for times. Throws Error(usage) if there is nothing to resume,
// Error(input) if the state belongs to another run, scene, program or other options. A failed gate
// throws Error(quality) after everything is written.
SimulationSummary run_finish(const FinishJob& job);

}  // namespace pilesim
