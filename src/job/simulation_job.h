// A scene file turned into a directory of results: the whole of `pilesim simulate` and of `pilesim
// direct-pile`.
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
  // Go on where the run in `output` stopped; begin where nothing is there. Not with `force`.
  bool resume = false;
  double checkpoint_period_s = 5;  // wall time between checkpoints, at least
  // The directory of another run: its bodies at the end are where those with the same names begin.
  std::optional<std::filesystem::path> from;
  std::optional<uint64_t> take;    // with `from`: job/last_state.h
  std::vector<QualityGate> gates;  // what the pile is judged by at the end
  uint64_t inspect_every = 0;      // frames between inspections of the pile; 0: at the end only
  std::function<void(const std::string&)> warn;  // before frame 0, of what starts inside others
  ProgressMode progress = ProgressMode::automatic;
  bool direct_piles = false;  // by the scene's guide, or by the angles of repose of its piles
  bool picture = false;       // of the end, in report.html
};

struct SimulationSummary {
  bool was_complete = false;  // nothing was left to resume; all below but warnings is empty
  uint64_t frames = 0;
  uint64_t bodies = 0;  // dynamic ones
  uint64_t static_bodies = 0, kinematic_bodies = 0;
  double frame_rate = 0;  // 1/s
  double simulated_s = 0;
  double wall_s = 0;
  std::optional<FrameQuality> deepest_inspected;  // of the frames that were inspected
  PileQuality quality;                            // at the end
  std::vector<std::string> collision_shapes;  // one line a shape: the error of its approximation
  std::vector<std::string> beginning;         // the run it goes on from, one line each
  std::vector<std::string> piles;             // one line a pile: the angle asked and got
  std::vector<std::string> signatures;        // one line a shape that collides by one
  std::vector<std::string> warnings;          // problems that did not stop it, one line each

  // Empty: nothing to warn of.
  void warn(const std::string& line) {
    if (!line.empty()) warnings.push_back(line);
  }
};

// An `output` with results in it is refused first of all. Loads and checks everything before it is
// touched, then takes over SIGINT, SIGTERM and SIGHUP, removes the earlier results and writes
// trajectory.zarr and timing.csv frame by frame and report.json and report.html at the end. Ctrl-C
// between frames ends the run early with a complete, shorter result and then throws
// Error(interrupted). A gate that the pile fails throws Error(quality), with all results written.
// Any other fault leaves the frames written so far and says how many they are. checkpoint.bin is
// written every few seconds; a run that is killed or interrupted is resumed from it and ends with
// the same bytes but for times. The picture comes last of all, when the run is whole; where
// it cannot be drawn that is a warning. Error(usage) where there is nothing to resume, Error(input)
// where the checkpoint is of another scene, command, program or start.
SimulationSummary run_simulation(const SimulationJob& job);

}  // namespace pilesim
