// The state of a run of simulate or direct-pile: checkpoint.bin in its directory, for --resume and
// --from.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "core/checkpoint_file.h"
#include "report/report_writer.h"
#include "simulate/simulator.h"

namespace pilesim {

inline constexpr char kCheckpointFile[] = "checkpoint.bin";

// Progress of a run, besides the simulator's state.
struct RunProgress {
  std::vector<FrameRow> rows;  // one row per finished frame
  std::vector<FrameQuality> inspections;
  double cpu_s = 0, wall_s = 0;
  double checkpoint_s = 0;  // part of the wall time
  // Consecutive final frames in which all was at rest, if rest ends the run.
  uint64_t quiet_frames = 0;
  bool is_settled = false;         // long enough at rest that the run is over
  std::vector<uint64_t> broke_at;  // frames by whose end each of Simulator::broken_joints() broke

  static void fields(auto& self, auto& stream) {
    stream(self.rows, self.inspections, self.cpu_s, self.wall_s, self.checkpoint_s,
           self.quiet_frames, self.is_settled, self.broke_at);
  }
};

// `scene_file`: place of the scene, for later jobs on the run.
void write_run_checkpoint(const std::filesystem::path& directory, const CheckpointKey& key,
                          const std::filesystem::path& scene_file, const RunProgress& progress,
                          const Simulator& simulator);
// Writes the final states of a completed run.
void write_last_states(const std::filesystem::path& directory, const CheckpointKey& key,
                       const std::filesystem::path& scene_file, const BodyStates& states);

class RunCheckpoint {
 public:
  // Throws Error(io), or Error(input) unless it is a whole checkpoint.
  explicit RunCheckpoint(const std::filesystem::path& directory);

  const CheckpointKey& key() const { return file_.key(); }
  void require(const CheckpointKey& wanted) const { file_.require(wanted); }
  bool is_done() const { return is_done_; }
  const BodyStates& bodies() const { return bodies_; }
  std::filesystem::path scene_file() const { return scene_file_; }  // absolute
  // Brings `simulator`, made from the run's scene, to the state of an unfinished run. Throws
  // Error(input).
  RunProgress load(Simulator& simulator) const;

 private:
  Checkpoint file_;
  bool is_done_ = false;
  std::string scene_file_;
  BodyStates bodies_;
  std::span<const std::byte> rest_;
};

// Throws Error(usage) for a directory with results but no state to resume from.
[[noreturn]] void throw_nothing_to_resume(const std::filesystem::path& directory);

}  // namespace pilesim
