// Where a run of simulate or direct-pile stands: checkpoint.bin in its directory, for --resume and
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
  std::vector<FrameRow> rows;  // a row a frame that is done
  std::vector<FrameQuality> inspections;
  double cpu_s = 0, wall_s = 0;
  double checkpoint_s = 0;    // of the wall time, for checkpoints
  uint64_t quiet_frames = 0;  // at the end, in which all was at rest, where that ends the run
  bool is_settled = false;    // so long that the run is over

  static void fields(auto& self, auto& stream) {
    stream(self.rows, self.inspections, self.cpu_s, self.wall_s, self.checkpoint_s,
           self.quiet_frames, self.is_settled);
  }
};

// `scene_file`: where the scene lies, for who works on with the run.
void write_run_checkpoint(const std::filesystem::path& directory, const CheckpointKey& key,
                          const std::filesystem::path& scene_file, const RunProgress& progress,
                          const Simulator& simulator);
// Writes the states of a run that is done.
void write_last_states(const std::filesystem::path& directory, const CheckpointKey& key,
                       const std::filesystem::path& scene_file, const BodyStates& states);

class RunCheckpoint {
 public:
  // Throws Error(io), or Error(input) for what is no whole checkpoint.
  explicit RunCheckpoint(const std::filesystem::path& directory);

  const CheckpointKey& key() const { return file_.key(); }
  void require(const CheckpointKey& wanted) const { file_.require(wanted); }
  bool is_done() const { return is_done_; }
  const BodyStates& bodies() const { return bodies_; }
  std::filesystem::path scene_file() const { return scene_file_; }  // absolute
  // Brings `simulator`, made from the run's scene, to where the run stands; for a run that is not
  // done. Throws Error(input).
  RunProgress load(Simulator& simulator) const;

 private:
  Checkpoint file_;
  bool is_done_ = false;
  std::string scene_file_;
  BodyStates bodies_;
  std::span<const std::byte> rest_;
};

// For a directory that has results but no state to resume from: Error(usage).
[[noreturn]] void throw_nothing_to_resume(const std::filesystem::path& directory);

}  // namespace pilesim
