// Writes the files of a run while it goes on, and keeps its totals.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "core/checkpoint_file.h"
#include "core/checkpoint_pace.h"
#include "core/clock.h"
#include "inspect/pile_inspection.h"
#include "job/settling.h"
#include "job/simulation_checkpoint.h"
#include "model/model.h"
#include "report/report_writer.h"
#include "scene/scene_loader.h"
#include "simulate/simulator.h"
#include "trajectory/trajectory.h"

namespace pilesim {

TrajectoryHeader make_header(const LoadedScene& loaded, const std::string& scene_hash,
                             const Model& model);

class RunRecorder {
 public:
  // Continues after `progress.rows.size()` frames; without progress it begins. `directory` receives
  // the files. `scene_file`: see write_run_checkpoint(). `watch` measures this process; it must
  // outlive the recorder. Throws Error(io).
  RunRecorder(std::filesystem::path directory, std::filesystem::path scene_file,
              double checkpoint_period_s, CheckpointKey key, const TrajectoryHeader& header,
              RunProgress progress, const Stopwatch& watch);

  void append(const Model& model, const Simulator& simulator, double frame_rate,
              FrameStatistics statistics);
  void inspect(const Model& model, const Vec3& gravity, const BodyStates& states);
  // True if the run is over.
  bool watch_settling(const Settling& settling, const Simulator& simulator);
  // Positions of the bodies at an earlier frame.
  EarlierPlaces places_before(uint64_t frame);

  bool is_checkpoint_due() const { return progress_.rows.size() == 1 || pace_.is_due(); }
  // Everything that a checkpoint or the last states refer to is on disk before them.
  void write_checkpoint(const Simulator& simulator);
  void write_end(const BodyStates& states);

  const RunProgress& progress() const { return progress_; }
  uint64_t frames_on_disk() const { return writer_.frames_on_disk(); }
  // Adds the times of earlier processes to those of this one.
  void measure_time();

 private:
  std::filesystem::path directory_, scene_file_;
  CheckpointKey key_;
  TrajectoryWriter writer_;
  TimingCsv timing_;
  CheckpointPace pace_;
  RunProgress progress_;
  struct {
    double cpu_s, wall_s;
  } before_;
  const Stopwatch& watch_;
  TrajectoryFrame stored_;
};

}  // namespace pilesim
