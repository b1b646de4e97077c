// Simulates a scene in several modes over several seeds, and reports speed against error: the whole
// of `pilesim compare`.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "core/progress.h"

namespace pilesim {

struct ComparisonJob {
  std::filesystem::path scene_file;
  std::filesystem::path output;
  std::filesystem::path program;       // pilesim itself, which runs each simulation
  std::vector<std::string> overrides;  // "/json/pointer=value", for all modes
  std::string modes;                   // "impulse:spheres7,statistical": mode_spec.h
  std::string reference;  // empty: impulse:decomposition, or impulse if no body has a mesh
  int runs = 5;           // >= 3: seeds scene.seed, scene.seed + 1, ...
  int times = 5;          // >= 1: moments at which distributions are compared
  bool force = false;     // replace an earlier comparison
  bool resume = false;    // keep the runs that an earlier comparison finished
  // Called when it waits for a signature that another run measures.
  std::function<void(const std::string&)> warn;
  ProgressMode progress = ProgressMode::automatic;
};

struct ComparisonSummary {
  struct Line {
    std::string mode;
    double speed_up, speed_up_low, speed_up_high;
    double error, error_low, error_high;  // largest normalised error; NaN: none
    std::string quantity;                 // the quantity with that error
  };
  std::vector<Line> lines;            // the reference first
  std::vector<std::string> warnings;  // non-fatal problems, one line each
};

// Checks all modes before any run. Each run is `program simulate` in its own process, so that
// memory is measured separately, with results in output/runs/MODE/seedN; each seed runs in all
// modes before the next. After Ctrl-C throws Error(interrupted). With `resume` the same job
// continues after its complete runs, provided that scene, files and program are unchanged. The
// reference's collision shapes judge the end of all runs. Throws Error(usage) if results exist and
// neither force nor resume is set, and the errors of the runs, which name the run.
ComparisonSummary run_comparison(const ComparisonJob& job);

}  // namespace pilesim
