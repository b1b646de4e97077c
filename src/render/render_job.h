// A trajectory turned into pictures: the whole of `pilesim render`.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/progress.h"
#include "render/frame_renderer.h"
#include "render/overlay.h"
#include "scene/scene.h"
#include "trajectory/trajectory.h"

namespace pilesim {

// Limit of sheet.png.
inline constexpr uint64_t kMostSheetPixels = uint64_t{1} << 28;
// Limit of x264.
inline constexpr int kWidestVideo = 16384;

// Makes a renderer of a trajectory; `colours` are the meaning of an overlay's colours.
using MakeRenderer = std::function<std::unique_ptr<FrameRenderer>(
    const TrajectoryHeader&, const RenderSettings&, BodyColours colours)>;

struct RenderJob {
  std::filesystem::path output;             // directory for frames/, video.mp4, sheet.png
  std::vector<uint64_t> frames;             // of the trajectory, ascending and evenly spaced
  std::optional<std::array<int, 2>> sheet;  // columns, rows: draw sheet.png and nothing else
  RenderSettings settings;
  MakeRenderer make_renderer;  // none: SceneRenderer
  Camera camera;               // with keys: cameras.h
  // All pictures show this frame of the trajectory: `frames` are then the numbers of the pictures.
  std::optional<uint64_t> still;
  // Drawn over the pictures, from the files in `overlay_source`. Not `beside`.
  std::optional<OverlayKind> overlay;
  std::filesystem::path overlay_source;  // directory
  // Drawn on the right of each picture, with the same camera, each side under its label. All of
  // `frames` are there, and frames follow each other as fast.
  TrajectoryReader* beside = nullptr;
  std::array<std::string, 2> labels;
  bool video = true;   // false: PNG frames only, and a video that is there stays
  bool force = false;  // replace pictures that are there
  // Keep the pictures that an interrupted or killed run of the same work has drawn; begin where
  // there are none. Not with `force`, and not of a sheet.
  bool resume = false;
  // For a renderer that keeps films, samples a pixel: `resume` goes on from fewer.
  std::optional<uint32_t> film_samples;
};

// Files of the picture of a frame below the output directory, and of its film (rays/film_store.h).
std::filesystem::path frame_file(const std::filesystem::path& output, uint64_t frame);
std::filesystem::path film_file(const std::filesystem::path& output, uint64_t frame);

struct RenderSummary {
  std::string result;                  // what to look at: the video, the frames or the sheet
  std::filesystem::path last_picture;  // of the frames; empty: a sheet
  size_t frames = 0;
  size_t kept = 0;  // of them, drawn before the work was resumed
  double wall_s = 0;
};

// Writes frames/frame.####.png, numbered as in the trajectory, and video.mp4, which plays at the
// trajectory's speed whatever frames are left out; cameras.json says where each is seen from.
// Error(usage) for sheets and videos that are too large. Drawing, PNG compression and video
// encoding overlap. Pictures that exist are refused (Error usage) first of all without `force`;
// with it each stays until a new one takes its place, and what is left of them at the end is
// removed. Takes over SIGINT, SIGTERM and SIGHUP: Ctrl-C finishes the video with the frames so far
// and throws Error(interrupted). render_checkpoint.bin says how many frames are done, for `resume`;
// Error(input) where it is of other work, Error(usage) where there is none beside pictures.
RenderSummary run_render(TrajectoryReader& trajectory, const RenderJob& job, ProgressMode progress);

// Throws where run_render() would refuse the job, before any work: sizes, and pictures that are
// there.
void check_render(const RenderJob& job);

}  // namespace pilesim
