#include "job/run_model.h"

#include "core/error.h"
#include "core/naming.h"
#include "job/run_filling.h"
#include "job/simulation_checkpoint.h"
#include "scene/scene_files.h"

namespace pilesim {
namespace {

namespace fs = std::filesystem;

// The directory of the run's scene.
fs::path place_of_scene(const fs::path& run) {
  const fs::path checkpoint = run / kCheckpointFile;
  std::error_code missing;
  if (fs::exists(checkpoint, missing)) return RunCheckpoint(run).scene_file();
  throw Error(ErrorKind::input,
              Problem{.file = run.string(),
                      .found = "has no checkpoint.bin that says where its scene is",
                      .remedy = "Name the scene file with --scene"});
}

// Reports its errors as those of the trajectory, whatever the scene file contains now.
LoadedScene parse_own_scene(const fs::path& run, const TrajectoryHeader& header,
                            const fs::path& scene_file) {
  try {
    return parse_scene(header.resolved_scene, scene_file);
  } catch (const Error& error) {
    std::vector<Problem> problems = error.problems();
    for (Problem& problem : problems) {
      if (problem.file == scene_file) problem.file = (run / "trajectory.zarr").string();
    }
    throw Error(error.kind(), std::move(problems));
  }
}

// Loads the scene stored in the trajectory, with files relative to `scene_file`.
LoadedScene load_own_scene(const fs::path& run, const TrajectoryHeader& header,
                           const fs::path& scene_file) {
  LoadedScene loaded = parse_own_scene(run, header, scene_file);
  for (const NamedFile& file : loaded.files) {
    if (!fs::exists(file.path)) {
      throw Error(ErrorKind::input,
                  Problem{.file = file.path.string(),
                          .pointer = file.pointer,
                          .found = "is not there",
                          .expected = "the file that the scene of " + run.string() + " names",
                          .remedy = "Name the scene file beside which it lies with --scene"});
    }
  }
  if (scene_hash(loaded) != header.scene_hash) {
    throw Error(ErrorKind::input,
                Problem{.file = scene_file.string(),
                        .found = "names files that have changed",
                        .expected = "those that " + run.string() + " was simulated with",
                        .remedy = "Simulate it again"});
  }
  return loaded;
}

}  // namespace

RunModel load_run_model(const fs::path& run, const TrajectoryHeader& header,
                        const std::optional<fs::path>& scene_file) {
  RunModel result{.scene_file = scene_file ? *scene_file : place_of_scene(run)};
  result.loaded = load_own_scene(run, header, result.scene_file);
  const Scene& scene = result.loaded.scene;
  result.model = naming(result.scene_file.string(), [&] { return build_model(scene); });
  take_filling(header, std::vector<bool>(header.body_count(), true), result.model);
  return result;
}

Scene stored_scene(const TrajectoryHeader& header, const fs::path& run,
                   std::span<const std::string> overrides) {
  Scene scene = parse_scene(header.resolved_scene, run / "trajectory.zarr", overrides).scene;
  const std::optional<fs::path>& sky = scene.render.light.sky_file;
  std::error_code missing;
  if (!sky || fs::exists(*sky, missing) || !fs::exists(run / kCheckpointFile, missing)) {
    return scene;
  }
  return parse_scene(header.resolved_scene, place_of_scene(run), overrides).scene;
}

}  // namespace pilesim
