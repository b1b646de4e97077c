#include "job/finish_stage.h"

#include <algorithm>

#include "core/error.h"
#include "core/interrupt.h"
#include "core/temporary_file.h"
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

}  // namespace

FinishedPile finish_trajectory(const FinishStage& stage, const std::filesystem::path& source,
                               const BodyStates& start, const std::filesystem::path& target,
                               uint64_t& frames) {
  const auto& [scene, model, longest_s, progress_mode] = stage;
  FinishedPile pile;
  {
    const auto movable =
        static_cast<uint64_t>(std::ranges::count(model.bodies, Role::dynamic, &ModelBody::role));
    Progress progress(progress_mode, "finish", std::max<uint64_t>(1, movable), "bodies");
    pile = bring_to_rest(scene, model, start, longest_s,
                         [&](const FrameStatistics&, size_t still, size_t) {
                           progress.update(still);
                           return !interrupted();
                         });
    progress.update(movable);
  }
  const bool was_interrupted = interrupted();
  TrajectoryReader trajectory(source);
  const uint64_t all = trajectory.frame_count();
  TrajectoryWriter writer(target, trajectory.header());
  Progress progress(progress_mode, "write", all, "frames");
  frames = write_eased(trajectory, scene, model, pile, writer, [&](uint64_t done) {
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
  FinishedPile pile = finish_trajectory(stage, directory, start, target, frames);
  if (pile.figures.interrupted) {
    remove_if_there(target);
  } else {
    move_to(place, directory / kSimulated);
    move_to(target, place);
  }
  return pile;
}

void forget_simulated(const fs::path& directory) { remove_if_there(directory / kSimulated); }

void restore_simulated(const fs::path& directory) {
  std::error_code missing;
  if (!fs::exists(directory / kSimulated, missing)) return;
  remove_if_there(directory / kTrajectory);
  move_to(directory / kSimulated, directory / kTrajectory);
}

}  // namespace pilesim
