#include "job/run_overlaps.h"

#include "finish/finished_pile.h"
#include "inspect/pile_inspection.h"

namespace pilesim {

RunOverlaps::RunOverlaps(const std::filesystem::path& run, TrajectoryReader& trajectory,
                         const std::optional<std::filesystem::path>& scene_file)
    : run_(run),
      trajectory_(trajectory),
      own_(load_run_model(run, trajectory.header(), scene_file)),
      diameter_m_(mean_diameter_m(own_.model)) {}

std::vector<float> RunOverlaps::of(uint64_t frame) const {
  const BodyStates states = states_at(trajectory_, frame, own_.model, run_.string());
  std::vector<float> shares;
  for (const double depth_m : overlap_depths(own_.model, states)) {
    shares.push_back(static_cast<float>(diameter_m_ > 0 ? depth_m / diameter_m_ : 0));
  }
  return shares;
}

}  // namespace pilesim
