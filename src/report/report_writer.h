// report.json, timing.csv and report.html of a simulation. Knows frames and times, not simulators.
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
  uint32_t bodies = 0;  // dynamic ones that are present
  uint32_t bodies_awake = 0;
  double kinetic_energy_j = 0;
  double potential_energy_j = 0;

  static void fields(auto& self, auto& stream) {
    stream(self.frame, self.time_s, self.steps, self.times, self.bodies, self.bodies_awake,
           self.kinetic_energy_j, self.potential_energy_j);
  }
};

// The pile at the end of a frame, by its collision shapes.
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
  uint64_t frames = 0;    // of the trajectory, of which quality is that of the last
  uint64_t dynamic_bodies = 0, static_bodies = 0, kinematic_bodies = 0;
  bool interrupted = false;
  std::vector<std::string> notes;             // what came of bodies that the scene did not ask for
  std::vector<std::string> collision_shapes;  // one line a shape: kind, pieces, errors
  std::vector<std::string> signatures;        // one line a shape that collides by one
  std::vector<FrameRow> rows;
  PileQuality quality;                    // at the end, of the collision shapes
  std::vector<FrameQuality> inspections;  // while it ran, where that was asked for
  std::vector<GateResult> gates;
  double setup_s = 0;       // loading, decomposition, building, wall
  double signatures_s = 0;  // of setup_s, for measuring them
  double inspection_s = 0;  // of the pile at the end, wall
  double total_s = 0;       // whole command, wall
  double checkpoint_s = 0;  // of total_s, for checkpoints
  double cpu_s = 0;         // of the frames, processor time of all threads
  uint64_t peak_memory_bytes = 0;
  std::string piles;         // JSON array: what a director of piles reports of each; empty: none
  std::string finish;        // JSON object: what finishing tells of itself; empty: none
  std::string until;         // JSON object: when all had come to rest; empty: not asked
  std::string mode_figures;  // JSON object: what the mode tells of itself; empty: nothing
};

// timing.csv, flushed row by row so that a killed run keeps its rows; it holds whole rows only,
// also where the disk fills up.
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

// report.json and report.html (self-contained, SVG charts by gnuplot). Where gnuplot is missing or
// fails the page says so in place of the charts, and what is returned tells why, naming the
// package; else it is empty. Throws Error(io).
std::string write_report(const SimulationReport& report, const std::filesystem::path& directory);

// Peak of this process so far, from the kernel.
uint64_t peak_memory_bytes();

}  // namespace pilesim
