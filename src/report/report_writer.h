// report.json, timing.csv and report.html of a simulation. Independent of simulators.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/pile_quality.h"
#include "core/stage_timer.h"
#include "report/quality_gate.h"

namespace pilesim {

// One row of timing.csv.
struct FrameRow {
  uint64_t frame = 0;
  double time_s = 0;  // simulated
  int steps = 0;
  StageTimes times;     // wall
  uint32_t bodies = 0;  // dynamic bodies present
  uint32_t bodies_awake = 0;
  double kinetic_energy_j = 0;
  double potential_energy_j = 0;

  static void fields(auto& self, auto& stream) {
    stream(self.frame, self.time_s, self.steps, self.times, self.bodies, self.bodies_awake,
           self.kinetic_energy_j, self.potential_energy_j);
  }
};

// The pile at the end of a frame, judged by its collision shapes.
struct FrameQuality {
  uint64_t frame = 0;
  PileQuality quality;

  static void fields(auto& self, auto& stream) {
    auto& q = self.quality;
    stream(self.frame, q.bodies, q.overlapping_pairs, q.deepest_penetration_m, q.mean_penetration_m,
           q.largest_gap_m, q.mean_gap_m, q.unsettled, q.escaped, q.floating, q.body_diameter_m);
  }
};

struct SimulationReport {
  std::string command;  // "simulate"
  std::string scene_name;
  std::string scene_file;  // its name, without directories
  std::string scene_hash;  // of the scene and its files
  std::string mode;
  std::string changed_options;  // JSON object of scene values that differ from defaults
  uint64_t seed = 0;
  int threads = 1;
  double step_s = 0;
  double frame_rate = 0;  // 1/s, of the trajectory
  uint64_t frames = 0;    // of the trajectory; `quality` belongs to the last one
  uint64_t dynamic_bodies = 0, static_bodies = 0, kinematic_bodies = 0;
  bool interrupted = false;
  std::vector<std::string> notes;             // bodies that were moved, came late or never
  std::vector<std::string> collision_shapes;  // one line per shape: kind, pieces, errors
  std::vector<std::string> signatures;        // one line per shape that has one
  std::vector<FrameRow> rows;
  PileQuality quality;                    // at the end, of the collision shapes
  std::vector<FrameQuality> inspections;  // during the run, if requested
  std::vector<GateResult> gates;
  double setup_s = 0;       // loading, decomposition, building, wall
  double signatures_s = 0;  // part of setup_s
  double inspection_s = 0;  // inspection of the final pile, wall
  double total_s = 0;       // whole command, wall
  double checkpoint_s = 0;  // part of total_s
  double cpu_s = 0;         // processor time of all threads, for the frames
  uint64_t peak_memory_bytes = 0;
  std::string piles;         // JSON array: a director's figures of each pile; empty: none
  std::string finish;        // JSON object: figures of finishing; empty: none
  std::string joints;        // JSON object: how many, and which broke when; empty: none
  std::string until;         // JSON object: when all bodies had come to rest; empty: not requested
  std::string mode_figures;  // JSON object: figures of the mode; empty: none
};

// timing.csv, flushed row by row so that a killed run keeps its rows. It contains only whole rows,
// even if the disk is full.
class TimingCsv {
 public:
  explicit TimingCsv(const std::filesystem::path& file);  // Error(io)
  ~TimingCsv();
  TimingCsv(const TimingCsv&) = delete;
  TimingCsv& operator=(const TimingCsv&) = delete;
  void append(const FrameRow& row);  // Error(io)

 private:
  void write_row(const std::string& row);

  int descriptor_;
  std::string path_;
  off_t whole_rows_ = 0;  // bytes
};

// report.json and report.html (self-contained, SVG charts by gnuplot). If gnuplot is missing or
// fails, the page says so in place of the charts, and the returned text says why and names the
// package; otherwise it is empty. Throws Error(io).
std::string write_report(const SimulationReport& report, const std::filesystem::path& directory);

// Peak of this process so far, as the kernel reports it.
uint64_t peak_memory_bytes();

}  // namespace pilesim
