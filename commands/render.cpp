#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>

#include "core/error.h"
#include "options.h"
#include "render/render_job.h"
#include "scene/scene_loader.h"

namespace pilesim {
namespace {

struct Options {
  std::string input;
  std::string output;
  std::vector<std::string> overrides;
  std::string frames;
  std::string size;
  int samples = 0;
  std::string sheet;
  bool no_video = false;
  RunOptions run;
};

// "64x48" as two positive numbers.
std::array<int, 2> parse_pair(const std::string& text, const std::string& option) {
  std::array<int, 2> pair{};
  int length = 0;
  if (std::sscanf(text.c_str(), "%6dx%6d%n", &pair[0], &pair[1], &length) != 2 ||
      static_cast<size_t>(length) != text.size() || pair[0] < 1 || pair[1] < 1) {
    throw CLI::ValidationError(option, "'" + text + "' is not two numbers such as 960x540");
  }
  return pair;
}

struct FrameRange {
  unsigned first = 0, last = 0, step = 1;
};

// "7", "1-100" or "1-100x2".
FrameRange parse_range(const std::string& text) {
  FrameRange range;
  int ends[3] = {};
  std::sscanf(text.c_str(), "%9u%n-%9u%nx%9u%n", &range.first, &ends[0], &range.last, &ends[1],
              &range.step, &ends[2]);
  if (ends[1] == 0) range.last = range.first;
  const int end = std::max({ends[0], ends[1], ends[2]});
  if (end == 0 || static_cast<size_t>(end) != text.size() || range.step == 0 ||
      range.last < range.first) {
    throw CLI::ValidationError("--frames",
                               "'" + text + "' is not FRAME, FIRST-LAST or FIRST-LASTxSTEP");
  }
  return range;
}

// The frames that `text` names, out of 0 .. count - 1; empty: all.
std::vector<uint64_t> selected_frames(const std::string& text, uint64_t count) {
  const FrameRange range =
      text.empty() ? FrameRange{0, static_cast<unsigned>(count - 1), 1} : parse_range(text);
  if (range.last >= count) {
    throw CLI::ValidationError("--frames", "'" + text + "' is not within 0-" +
                                               std::to_string(count - 1) +
                                               ", the frames of the trajectory");
  }
  std::vector<uint64_t> frames;
  for (uint64_t frame = range.first; frame <= range.last; frame += range.step) {
    frames.push_back(frame);
  }
  return frames;
}

// Checks while parsing, before anything is opened.
std::string check_pair(const std::string& text) {
  parse_pair(text, "a size");
  return {};
}
std::string check_range(const std::string& text) {
  parse_range(text);
  return {};
}

void render(const Options& options) {
  TrajectoryReader trajectory(options.input);
  const Scene scene =
      parse_scene(trajectory.header().resolved_scene,
                  std::filesystem::path(options.input) / "trajectory.zarr", options.overrides)
          .scene;
  RenderJob job{.output = options.output.empty() ? options.input : options.output,
                .frames = selected_frames(options.frames, trajectory.frame_count()),
                .settings = scene.render,
                .camera = scene.camera,
                .video = !options.no_video,
                .force = options.run.force};
  if (!options.size.empty()) job.settings.size = parse_pair(options.size, "--size");
  if (options.samples > 0) job.settings.samples = options.samples;
  if (!options.sheet.empty()) job.sheet = parse_pair(options.sheet, "--sheet");

  const RenderSummary summary =
      run_render(trajectory, job, options.run.quiet ? ProgressMode::none : options.run.progress);
  if (options.run.quiet) return;
  std::printf("%s: %zu frames in %.1f s\n", summary.result.c_str(), summary.frames, summary.wall_s);
}

}  // namespace

void add_render_command(CLI::App& app) {
  auto options = std::make_shared<Options>();
  CLI::App* command =
      app.add_subcommand("render", "Draw a trajectory to PNG frames and an MP4, off screen");
  command->add_option("input", options->input, "What simulate wrote: a directory")->required();
  command->add_option("-o,--output", options->output,
                      "Directory for frames/, video.mp4 and sheet.png (default: the input)");
  command->add_option("--frames", options->frames, "Frames to draw (default: all)")
      ->check(check_range, "")
      ->type_name("FIRST-LASTxSTEP");
  command
      ->add_option("--size", options->size, "Size of the picture in pixels (default: the scene's)")
      ->check(check_pair, "")
      ->type_name("WIDTHxHEIGHT");
  command->add_option("--samples", options->samples, "Anti-aliasing samples (default: the scene's)")
      ->check(CLI::IsMember({1, 2, 4, 8}));
  command
      ->add_option("--sheet", options->sheet,
                   "Draw one picture of evenly spaced frames, sheet.png, and nothing else")
      ->check(check_pair, "")
      ->type_name("COLUMNSxROWS");
  command->add_flag("--no-video", options->no_video, "Write the PNG frames only; needs no ffmpeg");
  command
      ->add_option("--set", options->overrides,
                   "Override a value of the camera or of render: --set /camera/position/1=2")
      ->type_name("/POINTER=VALUE")
      ->allow_extra_args(false);
  add_run_options(*command, options->run);
  command->footer(R"(
Examples:
  pilesim render out/crate
  pilesim render out/crate --sheet 4x3
  pilesim render out/crate -o out/close --frames 30-90x2 --size 1920x1080 --samples 8
  pilesim render out/crate --set '/camera={"position": [3, 2, 4], "target": [0, 0.5, 0]}')");
  command->callback([options] { render(*options); });
}

}  // namespace pilesim
