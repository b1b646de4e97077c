#include "job/simulation_checkpoint.h"

#include "core/error.h"
#include "core/naming.h"

namespace pilesim {

void write_run_checkpoint(const std::filesystem::path& directory, const CheckpointKey& key,
                          const std::filesystem::path& scene_file, const RunProgress& progress,
                          const Simulator& simulator) {
  StateWriter writer;
  writer(false, std::filesystem::absolute(scene_file).string(), simulator.states(), progress);
  simulator.save(writer);
  write_checkpoint(directory / kCheckpointFile, key, writer.bytes());
}

void write_last_states(const std::filesystem::path& directory, const CheckpointKey& key,
                       const std::filesystem::path& scene_file, const BodyStates& states) {
  StateWriter writer;
  writer(true, std::filesystem::absolute(scene_file).string(), states);
  write_checkpoint(directory / kCheckpointFile, key, writer.bytes());
}

RunCheckpoint::RunCheckpoint(const std::filesystem::path& directory)
    : file_(directory / kCheckpointFile) {
  naming(file_.path().string(), [&] {
    StateReader reader(file_.state());
    reader(is_done_, scene_file_, bodies_);
    rest_ = file_.state().last(reader.left());
  });
}

RunProgress RunCheckpoint::load(Simulator& simulator) const {
  return naming(file_.path().string(), [&] {
    StateReader reader(rest_);
    RunProgress progress;
    reader(progress);
    StateReader::require(!progress.rows.empty(), "a frame that is done");
    simulator.load(reader);
    StateReader::require(reader.left() == 0, "no more bytes");
    return progress;
  });
}

void throw_nothing_to_resume(const std::filesystem::path& directory) {
  throw Error(ErrorKind::usage, Problem{.file = directory.string(),
                                        .found = "has results but no checkpoint to resume from",
                                        .remedy = "Start again with --force in place of --resume"});
}

}  // namespace pilesim
