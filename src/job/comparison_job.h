// A scene simulated in several ways over several seeds, and a report of speed against error: the
// whole of `pilesim compare`.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/progress.h"

namespace pilesim {

struct ComparisonJob {
  std::filesystem::path scene_file;
  std::filesystem::path output;
  std::filesystem::path program;       // pilesim itself, which runs each simulation
  std::vector<std::string> overrides;  // "/json/pointer=value", of all modes
  std::string modes;                   // "impulse:spheres7,statistical": mode_spec.h
  std::string reference;  // empty: impulse:decomposition, or impulse where no body has a mesh
  int runs = 5;           // >= 3: seeds scene.seed, scene.seed + 1, ...
  int times = 5;          // >= 1: moments at which distributions are compared
  bool force = false;     // replace an earlier comparison
  bool resume = false;    // keep the runs that an earlier comparison finished
  ProgressMode progress = ProgressMode::automatic;
};

struct ComparisonSummary {
  struct Line {
    std::string mode;
    double speed_up, speed_up_low, speed_up_high;
    double error, error_low, error_high;  // the largest normalised one; not finite: none
    std::string quantity;                 // that has it
  };
  std::vector<Line> lines;            // the reference first
  std::vector<std::string> warnings;  // problems that did not stop it, one line each
};

// Checks all modes before it runs any. Each run is `program simulate` in a process of its own, so
// that its memory is its own, with its results in output/runs/MODE/seedN, seed by seed over all
// modes. After Ctrl-C throws Error(interrupted); with `resume` the same job goes on from the runs
// that were complete, if neither the scene, its files nor the program changed. The end of all runs
// is judged by the reference's collision shapes. Throws Error(usage) where there are results
// already and neither force nor resume, and what the runs throw, naming the run.
ComparisonSummary run_comparison(const ComparisonJob& job);

}  // namespace pilesim
