#include "job/finish_stage.h"

#include <algorithm>

#include "core/interrupt.h"
#include "trajectory/trajectory.h"

namespace pilesim {

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

}  // namespace pilesim
