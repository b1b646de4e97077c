// Penetration depths of a run's bodies, frame by frame.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "job/run_model.h"

namespace pilesim {

class RunOverlaps {
 public:
  // As load_run_model(), with its errors. `trajectory`, from directory `run`, must outlive it.
  RunOverlaps(const std::filesystem::path& run, TrajectoryReader& trajectory,
              const std::optional<std::filesystem::path>& scene_file);

  // (bodies) overlap_depths() in mean diameters of the dynamic bodies.
  std::vector<float> of(uint64_t frame) const;
  double diameter_m() const { return diameter_m_; }

 private:
  std::filesystem::path run_;
  TrajectoryReader& trajectory_;
  RunModel own_;
  double diameter_m_;
};

}  // namespace pilesim
