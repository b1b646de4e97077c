#include "render/cameras.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/philox.h"
#include "json/codec.h"
#include "render/pinhole.h"
#include "render/scene_renderer.h"
#include "scene/camera_path.h"

namespace pilesim {
namespace {

// The middle of the moving bodies in the last frame: of the pile that came about.
Vec3 middle_of_pile(TrajectoryReader& trajectory) {
  const TrajectoryHeader& header = trajectory.header();
  TrajectoryFrame frame;
  trajectory.read(trajectory.frame_count() - 1, frame);
  Vec3 sum = Vec3::Zero();
  size_t count = 0;
  for (size_t body = 0; body < header.body_count(); ++body) {
    if (header.body_moves[body] == 0 || (frame.state[body] & kPresent) == 0) continue;
    sum += frame.position[body];
    ++count;
  }
  return count == 0 ? sum : Vec3(sum / static_cast<double>(count));
}

Vec3 towards(double azimuth, double elevation) {
  return {std::cos(elevation) * std::sin(azimuth), std::sin(elevation),
          std::cos(elevation) * std::cos(azimuth)};
}

Camera on_orbit(const CameraOrbit& orbit, const Vec3& target, double field_of_view,
                const TrajectoryReader& trajectory) {
  Camera camera;
  for (uint64_t frame = 0; frame < trajectory.frame_count(); ++frame) {
    const double time_s = static_cast<double>(frame) / trajectory.header().frame_rate;
    const double azimuth = orbit.azimuth + 2 * kPi * time_s / orbit.period_s;
    camera.keys.push_back(
        {.time_s = time_s,
         .position = target + orbit.distance_m * towards(azimuth, orbit.elevation),
         .target = target,
         .field_of_view = field_of_view});
  }
  return camera;
}

// As many directions on each piece of the hemisphere as on any other of its size.
Camera random_view(const RandomViews& views, const Vec3& target, double field_of_view,
                   Philox draws) {
  const double azimuth = draws.uniform(0, 2 * kPi);
  const double low = std::sin(views.elevation[0]), high = std::sin(views.elevation[1]);
  const double elevation = std::asin(std::clamp(draws.uniform(low, high), -1.0, 1.0));
  const double distance = draws.uniform(views.distance_m[0], views.distance_m[1]);
  return {{{.position = target + distance * towards(azimuth, elevation),
            .target = target,
            .field_of_view = field_of_view}}};
}

void append_views(TrajectoryReader& trajectory, const NamedCamera& named, uint64_t seed,
                  size_t index, std::vector<ChosenCamera>& chosen) {
  if (named.path) {
    chosen.push_back({named.name, *named.path});
    return;
  }
  const auto target = [&](const std::optional<Vec3>& told) {
    return told ? *told : middle_of_pile(trajectory);
  };
  if (named.orbit) {
    chosen.push_back({named.name, on_orbit(*named.orbit, target(named.orbit->target),
                                           named.field_of_view, trajectory)});
    return;
  }
  const RandomViews& views = *named.random_views;
  const Vec3 middle = target(views.target);
  for (int view = 0; view < views.count; ++view) {
    char number[16];
    std::snprintf(number, sizeof number, "_%03d", view);
    chosen.push_back({named.name + number, random_view(views, middle, named.field_of_view,
                                                       Philox(seed, Stream::camera, index,
                                                              static_cast<uint32_t>(view)))});
  }
}

Json rows_of(const Mat3& matrix) {
  Json rows = Json::array();
  for (int row = 0; row < 3; ++row) {
    rows.push_back({matrix(row, 0), matrix(row, 1), matrix(row, 2)});
  }
  return rows;
}

Json entry_of(const CameraKey& key, uint64_t frame, std::array<int, 2> size) {
  const Pinhole eye = make_pinhole(key, size[0], size[1]);
  Mat3 k = Mat3::Identity();
  k(0, 0) = eye.fx;
  k(1, 1) = eye.fy;
  k(0, 2) = eye.cx;
  k(1, 2) = eye.cy;
  return {{"frame", frame},
          {"time_s", key.time_s},
          {"K", rows_of(k)},
          {"R", rows_of(eye.rotation)},
          {"t", {eye.translation.x(), eye.translation.y(), eye.translation.z()}},
          {"depth_unit_mm", depth_unit_mm(key)}};
}

}  // namespace

Camera main_camera(TrajectoryReader& trajectory, const Scene& scene) {
  if (!scene.camera.keys.empty()) return scene.camera;
  const auto [width, height] = scene.render.size;
  return {{frame_action(trajectory, static_cast<double>(width) / height)}};
}

std::vector<ChosenCamera> choose_cameras(TrajectoryReader& trajectory, const Scene& scene,
                                         const std::string& name) {
  std::vector<ChosenCamera> chosen;
  std::vector<std::string> names = {kMainCamera};
  if (name == kMainCamera || name == kAllCameras) {
    chosen.push_back({kMainCamera, main_camera(trajectory, scene)});
  }
  for (size_t i = 0; i < scene.cameras.size(); ++i) {
    names.push_back(scene.cameras[i].name);
    if (name != kAllCameras && name != scene.cameras[i].name) continue;
    append_views(trajectory, scene.cameras[i], scene.seed, i, chosen);
  }
  if (!chosen.empty()) return chosen;
  names.emplace_back(kAllCameras);
  throw Error(ErrorKind::usage, Problem{.file = "--camera",
                                        .found = "\"" + name + "\" is no camera of the scene",
                                        .expected = "one of " + quoted_list(names)});
}

Camera turned_about(const CameraKey& key, uint64_t count, double frame_rate) {
  Camera camera;
  for (uint64_t i = 0; i < count; ++i) {
    const double angle = 2 * kPi * static_cast<double>(i) / static_cast<double>(count);
    const Eigen::AngleAxisd turn(angle, Vec3::UnitY());
    CameraKey turned = key;
    turned.time_s = static_cast<double>(i) / frame_rate;
    turned.position = key.target + turn * (key.position - key.target);
    camera.keys.push_back(turned);
  }
  return camera;
}

void write_cameras_file(const std::filesystem::path& file, const Camera& camera,
                        const std::vector<uint64_t>& frames, std::optional<uint64_t> still,
                        double frame_rate, std::array<int, 2> size) {
  const Json convention = {
      {"K", "pixels, 3 x 3 row by row; (0, 0) is the middle of the upper left pixel"},
      {"R, t",
       "m: a point p of the world (y up) is at R p + t in the camera's frame (OpenCV: x right, y "
       "down, z forward), and at K (R p + t) / z in the picture"},
      {"depth_unit_mm", "of the 16-bit depth pass"}};
  std::string text = "{\"convention\": " + convention.dump() +
                     ",\n\"width\": " + std::to_string(size[0]) +
                     ", \"height\": " + std::to_string(size[1]) + ",\n\"frames\": [";
  for (size_t i = 0; i < frames.size(); ++i) {
    CameraKey key = camera_at(camera, static_cast<double>(frames[i]) / frame_rate);
    key.time_s = static_cast<double>(frames[i]) / frame_rate;
    Json entry = entry_of(key, frames[i], size);
    if (still) entry["shows_frame"] = *still;
    text += (i == 0 ? "\n" : ",\n") + entry.dump();
  }
  write_file_atomically(file, text + "]}\n");
}

}  // namespace pilesim
