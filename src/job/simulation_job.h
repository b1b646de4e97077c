// Runs a scene file and writes a directory of results: the whole of `pilesim simulate` and of
// `pilesim direct-pile`.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/pile_quality.h"
#include "core/progress.h"
#include "report/quality_gate.h"
#include "report/report_writer.h"

namespace pilesim {

struct SimulationJob {
  std::filesystem::path scene_file;
  std::filesystem::path output;        // directory; see write order in run_simulation()
  std::vector<std::string> overrides;  // "/json/pointer=value"
  bool force = false;                  // replace the output of an earlier run
  // Continue the run in `output`, or begin if there is none. Excludes `force`.
  bool resume = false;
  double checkpoint_period_s = 5;  // least wall time between checkpoints
  // The directory of another run: bodies start in the last state of those with the same names.
  std::optional<std::filesystem::path> from;
  std::optional<uint64_t> take;    // with `from`: job/last_state.h
  std::vector<QualityGate> gates;  // limits for the final pile
  uint64_t inspect_every = 0;      // frames between inspections of the pile; 0: only at the end
  // Called before frame 0 with bodies that start inside others, or when it waits for another run.
  std::function<void(const std::string&)> warn;
  ProgressMode progress = ProgressMode::automatic;
  bool direct_piles = false;  // by the scene's guide, or the angles of repose of its piles
  bool picture = false;       // draw the end into report.html
};

struct SimulationSummary {
  // Nothing was left to resume; all fields below except warnings are empty.
  bool was_complete = false;
  uint64_t frames = 0;
  uint64_t bodies = 0;  // number of dynamic ones
  uint64_t static_bodies = 0, kinematic_bodies = 0;
  double frame_rate = 0;  // 1/s
  double simulated_s = 0;
  double wall_s = 0;
  std::optional<FrameQuality> deepest_inspected;  // over all inspected frames
  PileQuality quality;                            // at the end
  std::vector<std::string> collision_shapes;  // one line per shape: the error of its approximation
  std::vector<std::string> beginning;         // about the run it continues, one line each
  std::vector<std::string> piles;       // one line per pile: the requested and the resulting angle
  std::vector<std::string> signatures;  // one line per shape that has one
  std::vector<std::string> warnings;    // non-fatal problems, one line each

  // Ignores empty lines.
  void warn(const std::string& line) {
    if (!line.empty()) warnings.push_back(line);
  }
};

// First rejects an `output` that contains results. Loads and checks everything before it changes
// `output`, then takes over SIGINT, SIGTERM and SIGHUP and removes earlier results. It writes
// trajectory.zarr and timing.csv frame by frame, and report.json and report.html at the end. Ctrl-C
// ends the run between frames with a complete, shorter result, then throws Error(interrupted). A
// failed gate throws Error(quality) after all results are written. Any other error keeps the frames
// written so far and states their number. checkpoint.bin is written every few seconds; a killed or
// interrupted run resumes from it and ends with the same bytes except for times. The picture is
// drawn last, when the run is complete; if that fails, it is only a warning. Throws Error(usage) if
// there is nothing to resume, Error(input) if the checkpoint belongs to another scene, command,
// program or start.
SimulationSummary run_simulation(const SimulationJob& job);

}  // namespace pilesim
