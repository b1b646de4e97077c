// Writes a page that plays a trajectory: the whole of `pilesim view`.
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
  std::filesystem::path beside;  // directory with guide.json and piles.json, if they exist
  ExportChoice choice;           // frames evenly spaced; the camera has at least one key
  std::string title, mode;       // of the scene, plain text
  RenderSettings render;         // of the scene: its light and exposure
  uint64_t most_bodies = 0;      // most moving bodies to show; if there are more, an even sample
  OverlapMeter overlaps;
  bool force = false;  // replace an existing page
};

struct ViewSummary {
  uint64_t bytes = 0;                 // of the page
  size_t bodies = 0, all_bodies = 0;  // moving ones: shown, and all
  size_t frames = 0, all_frames = 0;
  double wall_s = 0;
};

// Writes one self-contained HTML file that needs no network, beside its place, and renames it.
// Throws as claim_output_file() and ExportSource do, Error(input) for invalid files beside the
// trajectory, and Error(io).
ViewSummary run_view(TrajectoryReader& trajectory, const ViewJob& job);

}  // namespace pilesim
