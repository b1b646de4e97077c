// The cameras of a scene: which are drawn, and cameras.json, where each one is in every frame.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "scene/scene.h"
#include "trajectory/trajectory.h"

namespace pilesim {

// The name of the scene's `camera` among the others.
inline constexpr const char* kMainCamera = "camera";
inline constexpr const char* kAllCameras = "all";

struct ChosenCamera {
  std::string name;  // of random views with their number: "views_003"
  Camera camera;     // with keys
};

// Those of that name, or all. An orbit has a key at each frame. Throws Error(usage) for a name that
// the scene does not have.
std::vector<ChosenCamera> choose_cameras(TrajectoryReader& trajectory, const Scene& scene,
                                         const std::string& name);

// The scene's own camera, or one that frames the action.
Camera main_camera(TrajectoryReader& trajectory, const Scene& scene);

// One turn of `key`, counterclockwise as seen from above, about the upright line through its
// target: a key at each of `count` pictures, `frame_rate` a second.
Camera turned_about(const CameraKey& key, uint64_t count, double frame_rate);

// Intrinsics and extrinsics of each frame (docs/datasets.md); with `still`, which frame of the
// trajectory all of them show. Throws Error(io).
void write_cameras_file(const std::filesystem::path& file, const Camera& camera,
                        const std::vector<uint64_t>& frames, std::optional<uint64_t> still,
                        double frame_rate, std::array<int, 2> size);

}  // namespace pilesim
