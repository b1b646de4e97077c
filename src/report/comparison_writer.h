// compare.json, compare.html and charts: speed, and distance from the reference, of each mode for a
// scene.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "core/pile_quality.h"
#include "core/stage_timer.h"
#include "report/run_measures.h"

namespace pilesim {

struct ComparedRun {
  uint64_t seed = 0;
  double simulated_s = 0;
  double setup_s = 0;  // wall: loading, decomposition, building
  StageTimes times;    // wall, of all frames
  double cpu_s = 0;    // processor time of all threads and frames
  uint64_t steps = 0;
  uint64_t peak_memory_bytes = 0;
  PileQuality quality;  // at the end, by the shapes that Comparison::judged_by describes
  RunMeasures measures;
  // Against the reference with the same seed; the reference itself against its run with the next
  // seed.
  MotionError motion;
};

struct ComparedMode {
  std::string name;                           // as the user wrote it
  std::vector<std::string> overrides;         // scene values that the name stands for
  std::vector<std::string> collision_shapes;  // one line per shape, with its error
  std::vector<ComparedRun> runs;              // by seed
};

struct Comparison {
  std::string scene_name, scene_file;
  int threads = 1;
  std::vector<std::string> judged_by;  // collision shapes used to judge the end
  std::vector<ComparedMode> modes;     // the reference first; at least 3 runs each
};

// The files that write_comparison() writes.
inline constexpr std::string_view kComparisonEntries[] = {
    "compare.json",        "compare.html",        "compare.pareto.svg", "compare.pareto.png",
    "compare.overlap.svg", "compare.overlap.png", "compare.errors.svg", "compare.errors.png",
    "compare.energy.svg",  "compare.energy.png"};

nlohmann::ordered_json comparison_json(const Comparison& comparison);

// Writes the self-contained compare.html, then compare.json. If gnuplot is missing or fails there
// are no charts, and the returned text says why; otherwise it is empty. Throws Error(io).
std::string write_comparison(const Comparison& comparison, const std::filesystem::path& directory);

}  // namespace pilesim
