// The scene and model of a run, for jobs that work on its trajectory.
#pragma once

#include <filesystem>
#include <optional>

#include "model/model.h"
#include "scene/scene_loader.h"
#include "trajectory/trajectory.h"

namespace pilesim {

struct RunModel {
  std::filesystem::path scene_file;
  LoadedScene loaded;
  Model model;  // its bodies are those of the trajectory, in their order
};

// The model of the run in the directory `run`, whose trajectory has `header`. `scene_file`: beside
// it its meshes are; none: where it was when it ran. Throws Error(io), or Error(input) where that
// is not known, and where files are missing or have changed since.
RunModel load_run_model(const std::filesystem::path& run, const TrajectoryHeader& header,
                        const std::optional<std::filesystem::path>& scene_file);

}  // namespace pilesim
