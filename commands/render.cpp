#include <algorithm>
#include <array>
#include <filesystem>
#include <memory>
#include <optional>

#include "core/atomic_file.h"
#include "core/counted.h"
#include "core/error.h"
#include "core/text.h"
#include "dataset_options.h"
#include "frame_range.h"
#include "numbers.h"
#include "options.h"
#include "print.h"
#include "render/cameras.h"
#include "render/dataset/dataset_job.h"
#include "render/rays/rays_renderer.h"
#include "render/render_job.h"
#include "report/html.h"
#include "scene/picture_limits.h"
#include "scene/scene.h"
#include "scene/scene_loader.h"

namespace pilesim {
namespace {

struct RenderArguments {
  std::string input;
  std::optional<std::string> output, compare_with, camera;
  std::optional<OverlayKind> overlay;
  std::optional<Renderer> renderer;
  std::optional<RayQuality> quality;
  std::optional<uint64_t> samples;
  Overrides overrides;
  DatasetOptions dataset;
  FrameRange frames;
  std::optional<std::array<int, 2>> sheet;
  bool no_video = false;
  bool resume = false;
  RunOptions run;
};

std::string directory_name(const std::string& path) {
  if (path.empty()) return "";  // which std::filesystem::absolute() refuses
  const std::filesystem::path full = std::filesystem::absolute(path).lexically_normal();
  return (full.has_filename() ? full : full.parent_path()).filename().string();
}

std::unique_ptr<TrajectoryReader> open_beside(const RenderArguments& options,
                                              const TrajectoryReader& trajectory) {
  if (!options.compare_with) return nullptr;
  auto beside = std::make_unique<TrajectoryReader>(*options.compare_with);
  const double rate = trajectory.header().frame_rate, other = beside->header().frame_rate;
  if (rate != other) {
    throw Error(ErrorKind::input,
                Problem{.file = *options.compare_with,
                        .found = with_digits(other, 6) + " frames a second",
                        .expected = with_digits(rate, 6) + ", as " + options.input + " has",
                        .remedy = "Simulate both scenes with the same frame_rate"});
  }
  return beside;
}

Scene scene_of(const TrajectoryHeader& header, const std::string& directory,
               const std::vector<std::string>& overrides) {
  return parse_scene(header.resolved_scene, std::filesystem::path(directory) / "trajectory.zarr",
                     overrides)
      .scene;
}

// What --renderer, --quality and --samples are short for.
void add_render_overrides(const TrajectoryHeader& header, RenderArguments& options) {
  Overrides& overrides = options.overrides;
  if (options.renderer) {
    const std::string word = *options.renderer == Renderer::rays ? "rays" : "raster";
    overrides.add("/render/renderer=\"" + word + "\"", "--renderer", word);
  }
  if (options.quality) {
    static const std::array<std::string, 3> kWords = {"preview", "good", "final"};
    const std::string& word = kWords[static_cast<size_t>(*options.quality)];
    if (options.renderer == Renderer::raster) {
      throw Error(ErrorKind::usage,
                  Problem{.found = "--quality " + word + " with --renderer raster",
                          .expected = "--renderer rays",
                          .remedy = "Leave one of them out"});
    }
    options.renderer = Renderer::rays;
    overrides.add("/render/renderer=\"rays\"", "--quality", word);
    overrides.add("/render/rays/quality=\"" + word + "\"", "--quality", word);
  }
  if (options.samples) {
    const Renderer renderer =
        options.renderer.value_or(scene_of(header, options.input, overrides.texts).render.renderer);
    const std::string number = std::to_string(*options.samples);
    overrides.add(
        (renderer == Renderer::rays ? "/render/rays/samples=" : "/render/samples=") + number,
        "--samples", number);
  }
}

// Surfaces look as the scene of each trajectory says.
MakeRenderer by_rays(const RenderArguments& options) {
  return [&options](const TrajectoryHeader& header, const RenderSettings& settings,
                    BodyColours colours) {
    return std::make_unique<RaysRenderer>(header, settings,
                                          scene_of(header, options.input, {}).materials, colours);
  };
}

// What one camera shows; without a camera yet.
struct CameraWork {
  RenderJob pictures;
  DatasetJob dataset;

  void set_camera(const Camera& camera) { pictures.camera = dataset.camera = camera; }
};

CameraWork work_of(const RenderArguments& options, const Scene& scene,
                   const std::vector<uint64_t>& frames, const std::filesystem::path& output) {
  CameraWork work{
      .pictures = {.output = output,
                   .frames = frames,
                   .sheet = options.sheet,
                   .settings = scene.render,
                   .make_renderer =
                       scene.render.renderer == Renderer::rays ? by_rays(options) : nullptr,
                   .labels = {directory_name(options.input),
                              directory_name(options.compare_with.value_or(""))},
                   .video = !options.no_video,
                   .force = options.run.force,
                   .resume = options.resume},
      .dataset = {.output = output,
                  .frames = frames,
                  .size = scene.render.size,
                  .passes = options.dataset.passes,
                  .coco = options.dataset.coco}};
  if (options.overlay) {
    work.pictures.overlay = options.overlay;
    work.pictures.overlay_source = options.input;
  }
  return work;
}

// So well that the report of the run opens with it.
bool shows_end(const TrajectoryReader& trajectory, const RenderJob& job) {
  constexpr int64_t kMostReportPixels = 1920 * 1080;
  const auto [width, height] = job.settings.size;
  return job.beside == nullptr && job.frames.back() + 1 == trajectory.frame_count() &&
         int64_t{width} * height <= kMostReportPixels;
}

void draw(TrajectoryReader& trajectory, const RenderArguments& options, const CameraWork& work) {
  const ProgressMode mode = options.run.quiet ? ProgressMode::none : options.run.progress;
  const RenderSummary summary = run_render(trajectory, work.pictures, mode);
  if (shows_end(trajectory, work.pictures) && !summary.last_picture.empty()) {
    put_picture(work.pictures.output / "report.html", kEndPicture, read_file(summary.last_picture),
                kEndLabel);
  }
  if (options.dataset.any()) run_dataset(trajectory, work.dataset, mode);
  if (options.run.quiet) return;
  const std::string kept =
      summary.kept > 0 ? " (" + std::to_string(summary.kept) + " of them drawn before)" : "";
  print("%s: %s%s in %.1f s\n", summary.result.c_str(), counted(summary.frames, "frame").c_str(),
        kept.c_str(), summary.wall_s);
}

void render(RenderArguments& options) {
  check_picture_overrides(options.overrides.texts);
  TrajectoryReader trajectory(options.input);
  std::unique_ptr<TrajectoryReader> beside = open_beside(options, trajectory);
  add_render_overrides(trajectory.header(), options);
  const Scene scene = scene_of(trajectory.header(), options.input, options.overrides.texts);
  const std::vector<uint64_t> frames = selected_frames(
      options.frames,
      beside ? std::min(trajectory.frame_count(), beside->frame_count()) : trajectory.frame_count(),
      trajectory.header().frame_rate);
  const std::filesystem::path output = options.output.value_or(options.input);
  std::vector<CameraWork> work;
  if (options.camera) {
    for (const ChosenCamera& chosen : choose_cameras(trajectory, scene, *options.camera)) {
      work.push_back(work_of(options, scene, frames, output / "cameras" / chosen.name));
      work.back().set_camera(chosen.camera);
    }
  } else {
    work.push_back(work_of(options, scene, frames, output));
  }
  for (size_t i = 0; i < work.size(); ++i) {
    work[i].pictures.beside = beside.get();
    if (options.dataset.bop) {
      work[i].dataset.bop = output / "bop";
      work[i].dataset.bop_scene = static_cast<int>(i);
    }
    check_render(work[i].pictures);
    claim_dataset(work[i].dataset, options.run.force || options.resume);
  }
  // Which reads the trajectory: only now, when nothing is refused.
  if (!options.camera) work.front().set_camera(main_camera(trajectory, scene));
  for (const CameraWork& each : work) draw(trajectory, options, each);
}

}  // namespace

void add_render_command(CLI::App& app) {
  auto options = std::make_shared<RenderArguments>();
  CLI::App* command =
      app.add_subcommand("render", "Draw a trajectory to PNG frames and an MP4, off screen");
  command->add_option("input", options->input, "What simulate wrote: a directory")
      ->required()
      ->check(named(), "");
  command->add_option("-o,--output", options->output,
                      "Directory for frames/, video.mp4 and sheet.png (default: the input)");
  command
      ->add_option_function<std::string>(
          "--frames",
          [options](const std::string& text) { options->frames = parse_frame_range(text); },
          std::string("Frames to draw: ") + kFramesHelp + " (default: all)")
      ->type_name("FIRST-LASTxSTEP");
  command
      ->add_option_function<std::string>(
          "--size",
          [options](const std::string& text) {
            const auto [width, height] = parse_pair(text, "--size");
            options->overrides.add(
                "/render/size=[" + std::to_string(width) + "," + std::to_string(height) + "]",
                "--size", text);
          },
          "Size of the picture in pixels, " + std::to_string(kSmallestSide) + " to " +
              std::to_string(kLargestSide) + " each and at most " + std::to_string(kMostPixels) +
              " in all (of odd sizes the video leaves a row or column out); the same as --set "
              "/render/size=[WIDTH,HEIGHT]")
      ->type_name("WIDTHxHEIGHT");
  add_choice<Renderer>(
      *command, "--renderer", {{"raster", Renderer::raster}, {"rays", Renderer::rays}},
      options->renderer,
      "raster (default): fast; rays: slow, with full meshes at any count and light "
      "from surface to surface; the same as --set /render/renderer=NAME");
  add_choice<RayQuality>(
      *command, "--quality",
      {{"preview", RayQuality::preview}, {"good", RayQuality::good}, {"final", RayQuality::final}},
      options->quality,
      "Of rays, which it implies: preview, good or final (default); the same as "
      "--set /render/rays/quality=NAME");
  add_whole_number(
      *command, "--samples", {1, kMostRaySamples},
      [options](uint64_t samples) { options->samples = samples; },
      "Samples a pixel: 1, 2, 4 or 8 of the raster renderer (default 4); by rays any number "
      "(default: as the quality has it); the same as --set /render/samples=N or "
      "/render/rays/samples=N");
  CLI::Option* overlay = add_choice<OverlayKind>(
      *command, "--overlay",
      {{"piles", OverlayKind::piles},
       {"guide", OverlayKind::guide},
       {"solver", OverlayKind::solver},
       {"forces", OverlayKind::forces}},
      options->overlay,
      "piles: the layers of directed piles as translucent cylinders, and what sleeps darker; "
      "guide: the guide, dots where bodies are held, and bodies in the colours of the analysis; "
      "solver: bodies in the colour of who steps them, with a legend, and what sleeps darker; "
      "forces: force chains of a pile that glue holds, as its analysis found it to stand: lines "
      "from "
      "body to body as thick as the force, blue where they push, red where glue pulls");
  command
      ->add_option("--compare-with", options->compare_with,
                   "Another directory that simulate wrote: drawn on the right of each picture with "
                   "the same camera, under the directories' names")
      ->type_name("DIRECTORY")
      ->check(named(), "")
      ->excludes(overlay);
  CLI::Option* sheet =
      command
          ->add_option_function<std::string>(
              "--sheet",
              [options](const std::string& text) { options->sheet = parse_pair(text, "--sheet"); },
              "Draw one picture of evenly spaced frames, sheet.png, and nothing else; at most " +
                  std::to_string(kMostSheetPixels) + " pixels")
          ->type_name("COLUMNSxROWS");
  command
      ->add_option(
          "--camera", options->camera,
          "One of the scene's cameras by its name, \"camera\" for the one without, or all: "
          "each into cameras/NAME/ of the output")
      ->type_name("NAME")
      ->check(named(), "");
  for (CLI::Option* option : add_dataset_options(*command, options->dataset)) {
    option->excludes(sheet)->excludes(command->get_option("--compare-with"));
  }
  command->add_flag("--no-video", options->no_video, "Write the PNG frames only; needs no ffmpeg")
      ->excludes(sheet);
  add_override_option(*command, options->overrides,
                      "Override a value of the camera or of render: --set /render/samples=8");
  CLI::Option* resume = command->add_flag(
      "--resume", options->resume,
      "Keep the pictures that the same command had drawn when it was interrupted or killed, and "
      "draw the others; where there are none, begin");
  add_run_options(*command, options->run);
  resume->excludes(command->get_option("--force"))->excludes(sheet);
  command->footer(R"(
Examples:
  pilesim render out/crate
  pilesim render out/crate --resume
  pilesim render out/crate --sheet 4x3
  pilesim render out/crate -o out/still --renderer rays --frames 150 --no-video
  pilesim render out/crate -o out/draft --quality preview
  pilesim render out/crate -o out/end --frames 120- --no-video
  pilesim render out/crate -o out/still --frames last --no-video
  pilesim render out/crate -o out/close --frames 30-90x2 --size 1920x1080 --samples 8
  pilesim render out/crate --passes depth,ids,normals --annotations coco,bop -o out/dataset
  pilesim render out/crate --camera all -o out/views
  pilesim render out/statistical --compare-with out/impulse -o out/both
  pilesim render out/crate --set '/camera={"position": [3, 2, 4], "target": [0, 0.5, 0]}')");
  command->callback(
      [options] { with_options_named(options->overrides, [&] { render(*options); }); });
}

}  // namespace pilesim
