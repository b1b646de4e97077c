#include "job/finish_stage.h"

#include <algorithm>

#include "core/checkpoint_pace.h"
#include "core/clock.h"
#include "core/counted.h"
#include "core/error.h"
#include "core/interrupt.h"
#include "core/naming.h"
#include "core/temporary_file.h"
#include "inspect/pile_inspection.h"
#include "job/simulation_checkpoint.h"
#include "trajectory/trajectory.h"

namespace pilesim {

namespace fs = std::filesystem;

namespace {

constexpr char kTrajectory[] = "trajectory.zarr";
constexpr char kFinishing[] = "finishing.zarr";
constexpr char kSimulated[] = "simulated.zarr";

void remove_if_there(const fs::path& path) {
  std::error_code missing;
  if (fs::exists(path, missing)) remove_in_one_go(path);
}

void move_to(const fs::path& from, const fs::path& to) {
  std::error_code fault;
  fs::rename(from, to, fault);
  if (fault) throw io_error(to.string(), "cannot be written", fault.value());
}

// A share of the bodies. With more a pile still falls, and finishing would visibly cut it short.
constexpr double kMostMoving = 0.1;

// Writes checkpoints of a pile on its way to rest; starts from an existing one.
class RestRecorder {
 public:
  RestRecorder(const FinishStage& stage, const fs::path& directory, ExactRest& rest)
      : file_(directory / kFinishingFile),
        key_(stage.key),
        rest_(rest),
        pace_(stage.checkpoint_period_s) {
    std::error_code missing;
    if (!fs::exists(file_, missing)) {
      write();
      return;
    }
    const Checkpoint checkpoint(file_);
    checkpoint.require(key_);
    naming(file_.string(), [&] {
      StateReader reader(checkpoint.state());
      reader(progress_);
      rest_.load(reader);
      StateReader::require(reader.left() == 0, "no more bytes");
    });
  }

  const RestProgress& progress() const { return progress_; }
  void take(const RestProgress& progress, bool is_last) {
    if (!is_last && !pace_.is_due()) return;
    progress_ = progress;
    write();
  }

 private:
  void write() {
    const Stopwatch clock;
    StateWriter writer;
    writer(progress_);
    rest_.save(writer);
    write_checkpoint(file_, key_, writer.bytes());
    pace_.wrote(clock.seconds());
  }

  fs::path file_;
  const CheckpointKey& key_;
  ExactRest& rest_;
  CheckpointPace pace_;
  RestProgress progress_;
};

FinishedPile rest_of(const FinishStage& stage, const BodyStates& start, const fs::path& directory) {
  ExactRest rest(stage.scene, stage.model, start, stage.settings);
  RestRecorder recorder(stage, directory, rest);
  Progress progress(stage.progress, "finish", std::max<uint64_t>(1, rest.movable()), "bodies");
  FinishedPile pile = bring_to_rest(stage.scene, stage.model, start, rest, recorder.progress(),
                                    [&](const RestProgress& done) {
                                      progress.update(rest.still());
                                      const bool stops = interrupted();
                                      recorder.take(done, stops || rest.is_over());
                                      return !stops;
                                    });
  progress.update(rest.movable());
  const PileQuality before = inspect_pile(stage.model, stage.scene.gravity, start);
  if (before.bodies > 0) {
    pile.figures.deepest_before = before.deepest_penetration_m / before.body_diameter_m;
  }
  return pile;
}

}  // namespace

RestSettings settings_of(const Finish& finish) {
  return {.longest_s = finish.longest_s, .visible_only = finish.visible_only};
}

bool is_to_be_finished(const Scene& scene, uint64_t bodies, uint64_t unsettled, std::string& note) {
  if (!scene.finishes_by_mode()) return scene.finish.when == Finishing::always;
  if (static_cast<double>(unsettled) <= kMostMoving * static_cast<double>(bodies)) return true;
  note = counted(unsettled, "body", "bodies") + " of " + std::to_string(bodies) +
         " still move at the end, so overlaps were left as they are; let the run last longer "
         "(\"duration_s\"), or set \"finish\" to true or false";
  return false;
}

FinishedPile finish_trajectory(const FinishStage& stage, const fs::path& source,
                               const BodyStates& start, const fs::path& directory,
                               const std::string& name, uint64_t& frames) {
  FinishedPile pile = rest_of(stage, start, directory);
  const bool was_interrupted = interrupted();
  TrajectoryReader trajectory(source);
  const uint64_t all = trajectory.frame_count();
  TrajectoryWriter writer(directory / name, trajectory.header());
  Progress progress(stage.progress, "write", all, "frames");
  frames = write_eased(trajectory, stage.scene, stage.model, pile, writer, [&](uint64_t done) {
    progress.update(done);
    return was_interrupted || !interrupted();
  });
  pile.figures.interrupted = pile.figures.interrupted || frames < all;
  writer.close();
  return pile;
}

FinishedPile finish_in_place(const FinishStage& stage, const fs::path& directory) {
  const fs::path target = directory / kFinishing, place = directory / kTrajectory;
  remove_if_there(target);
  BodyStates start;
  {
    TrajectoryReader trajectory(directory);
    start = last_states(trajectory, stage.model, directory.string());
  }
  uint64_t frames = 0;
  FinishedPile pile = finish_trajectory(stage, directory, start, directory, kFinishing, frames);
  if (pile.figures.interrupted) {
    remove_if_there(target);
  } else {
    move_to(place, directory / kSimulated);
    move_to(target, place);
  }
  return pile;
}

PileQuality inspect_finished(const Scene& scene, const Model& model, FinishedPile& pile) {
  if (pile.left.empty()) return inspect_pile(model, scene.gravity, pile.states);
  BodyStates finished = pile.states, left = pile.states;
  for (uint32_t i = 0; i < model.bodies.size(); ++i) {
    if (model.bodies[i].role == Role::dynamic) left.flags[i] &= static_cast<uint8_t>(~kPresent);
  }
  for (const uint32_t body : pile.left) {
    finished.flags[body] |= kHeld;
    left.flags[body] |= kPresent;
  }
  const PileQuality apart = inspect_pile(model, scene.gravity, left);
  pile.figures.deepest_left = apart.deepest_penetration_m / apart.body_diameter_m;
  return inspect_pile(model, scene.gravity, finished);
}

std::string resumed_after(const FinishedPile& pile) {
  return "resumed after " + counted(pile.steps_before, "step") + " of finishing";
}

void forget_finishing(const fs::path& directory) {
  remove_if_there(directory / kSimulated);
  remove_if_there(directory / kFinishingFile);
}

void restore_simulated(const fs::path& directory) {
  std::error_code missing;
  if (!fs::exists(directory / kSimulated, missing)) return;
  remove_if_there(directory / kTrajectory);
  move_to(directory / kSimulated, directory / kTrajectory);
}

}  // namespace pilesim
