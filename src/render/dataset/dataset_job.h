// Passes and annotations of frames of a trajectory, beside the pictures that run_render() drew.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "core/progress.h"
#include "render/dataset/pass_files.h"
#include "scene/scene.h"
#include "trajectory/trajectory.h"

namespace pilesim {

struct DatasetJob {
  std::filesystem::path output;  // the camera's directory: pictures are there
  std::vector<uint64_t> frames;  // of the trajectory, ascending
  std::array<int, 2> size = {0, 0};
  Camera camera;                             // with keys
  std::vector<Pass> passes;                  // written to passes/
  bool coco = false;                         // coco.json
  std::optional<std::filesystem::path> bop;  // directory of the dataset that all cameras share
  int bop_scene = 0;                         // the number of this camera's scene there
};

// Files of it that are there already, below `output` and `bop`: refused (Error usage) without
// `force`, removed with it.
void claim_dataset(const DatasetJob& job, bool force);

// Frame by frame; annotations at the end. The same bytes whatever else is drawn. Throws Error(io),
// and Error(interrupted) after Ctrl-C, with annotations of the frames so far.
void run_dataset(TrajectoryReader& trajectory, const DatasetJob& job, ProgressMode progress);

}  // namespace pilesim
