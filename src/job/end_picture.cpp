#include "job/end_picture.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <functional>
#include <optional>

#include "core/error.h"
#include "core/isolated.h"
#include "render/cameras.h"
#include "render/image_output.h"
#include "report/html.h"
#include "scene/camera_path.h"
#include "trajectory/trajectory.h"

namespace pilesim {
namespace {

// Sharp enough for the width of a page, at 0.2 to 0.7 MB.
constexpr double kMostPixels = 800 * 450;

// A small size with the scene's aspect ratio.
RenderSettings small(RenderSettings settings) {
  const auto [width, height] = settings.size;
  const double scale = std::min(1.0, std::sqrt(kMostPixels / width / height));
  settings.size = {static_cast<int>(scale * width), static_cast<int>(scale * height)};
  return settings;
}

// In a separate process, since misconfigured drivers crash.
std::string isolated_png(const std::function<std::string()>& draw_png) {
  constexpr IsolationLimits kLimits{.memory_bytes = uint64_t{64} << 30, .cpu_s = 600};
  constexpr char kDrawn = '+', kFailed = '-';
  const IsolatedResult result = run_isolated(
      [&] {
        try {
          return kDrawn + draw_png();
        } catch (const Error& error) {
          return kFailed + std::string(error.what());
        }
      },
      kLimits);
  if (!result.fault.empty()) {
    throw Error(ErrorKind::internal, Problem{.found = "drawing it " + result.fault});
  }
  if (result.bytes[0] == kFailed) {
    throw Error(ErrorKind::internal, Problem{.found = result.bytes.substr(1)});
  }
  return result.bytes.substr(1);
}

std::string draw(const EndPicture& picture, const RenderSettings& settings, const Scene& scene,
                 std::optional<Camera>& camera) {
  TrajectoryReader trajectory(picture.run);
  if (!camera) camera = main_camera(trajectory, scene);
  const uint64_t last = trajectory.frame_count() - 1;
  TrajectoryFrame frame;
  trajectory.read(last, frame);
  const double time_s = static_cast<double>(last) / trajectory.header().frame_rate;
  return isolated_png([&] {
    SceneRenderer renderer(trajectory.header(), settings);
    return png_of(renderer.draw(frame, camera_at(*camera, time_s)));
  });
}

}  // namespace

std::string put_end_pictures(const std::filesystem::path& page, const Scene& scene,
                             std::span<const EndPicture> runs) {
  const RenderSettings settings = small(scene.render);
  std::optional<Camera> camera;
  for (const EndPicture& picture : runs) {
    std::string png;
    try {
      png = draw(picture, settings, scene, camera);
    } catch (const std::exception& error) {
      return page.filename().string() + " lacks a picture of the pile: " + error.what();
    }
    put_picture(page, picture.place, png, picture.label);
  }
  return {};
}

std::string put_end_picture(const std::filesystem::path& run, const Scene& scene) {
  const EndPicture picture{.run = run, .place = kEndPicture, .label = kEndLabel};
  return put_end_pictures(run / "report.html", scene, {&picture, 1});
}

std::string put_missing_end_picture(const std::filesystem::path& run, const Scene& scene) {
  if (!lacks_picture(run / "report.html", kEndPicture)) return {};
  return put_end_picture(run, scene);
}

}  // namespace pilesim
