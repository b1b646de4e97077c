// The scene and model of a run, for jobs that work on its trajectory.
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>

#include "model/model.h"
#include "scene/scene_loader.h"
#include "trajectory/trajectory.h"

namespace pilesim {

struct RunModel {
  std::filesystem::path scene_file;
  LoadedScene loaded;
  Model model;  // with the bodies of the trajectory in their order
};

// The model of the run in directory `run` with the trajectory `header`. `scene_file`: its meshes
// are beside it; none: its place when it ran. Throws Error(io), or Error(input) if that place is
// unknown, or files are missing or have changed.
RunModel load_run_model(const std::filesystem::path& run, const TrajectoryHeader& header,
                        const std::optional<std::filesystem::path>& scene_file);

// The scene that a trajectory has stored, changed by `overrides`. A picture of the sky lies beside
// the run, or else where it lay when the run was simulated. Throws as parse_scene() does.
Scene stored_scene(const TrajectoryHeader& header, const std::filesystem::path& run,
                   std::span<const std::string> overrides = {});

}  // namespace pilesim
