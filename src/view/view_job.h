// A trajectory as a page that plays it: the whole of `pilesim view`.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "export/export_source.h"
#include "trajectory/trajectory.h"
#include "view/view_data.h"

namespace pilesim {

struct ViewJob {
  std::filesystem::path output;  // the page
  std::filesystem::path beside;  // directory with guide.json and piles.json, where there are some
  ExportChoice choice;           // frames evenly spaced; the camera has a key at least
  std::string title, mode;       // of the scene, plain text
  uint64_t most_bodies = 0;      // that move; of more some are shown, spread evenly over all
  OverlapMeter overlaps;
  bool force = false;  // replace a page that is there
};

struct ViewSummary {
  uint64_t bytes = 0;                 // of the page
  size_t bodies = 0, all_bodies = 0;  // that move: shown, there are
  size_t frames = 0, all_frames = 0;
  double wall_s = 0;
};

// One HTML file that needs no other and no network. Written beside its place and renamed. Throws as
// claim_output_file() and ExportSource do, Error(input) for files beside the trajectory that are
// not what their names say, and Error(io).
ViewSummary run_view(TrajectoryReader& trajectory, const ViewJob& job);

}  // namespace pilesim
