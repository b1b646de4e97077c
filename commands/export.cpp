#include "export/export_job.h"

#include <filesystem>
#include <memory>
#include <optional>

#include "core/counted.h"
#include "core/text.h"
#include "frame_range.h"
#include "numbers.h"
#include "options.h"
#include "print.h"
#include "render/scene_renderer.h"
#include "scene/scene_loader.h"
#include "trajectory/trajectory.h"

namespace pilesim {
namespace {

struct ExportArguments {
  std::string input, output;
  FrameRange frames;
  std::string option = "--frames";  // that gave them
  uint64_t every = 1;
  std::vector<std::string> only;
  std::optional<ExportForm> form;
  std::optional<uint64_t> part_bytes;
  bool no_camera = false, force = false, quiet = false;
};

std::vector<uint64_t> chosen_frames(const ExportArguments& options,
                                    const TrajectoryReader& trajectory) {
  const uint64_t count = trajectory.frame_count();
  FrameRange range = options.frames;
  // Steps of steps; beyond the last frame they are all the same.
  range.step = std::min(range.step, count) * options.every;
  return selected_frames(range, count, trajectory.header().frame_rate, options.option);
}

void run_export_command(const ExportArguments& options) {
  claim_export(options.output, options.force);
  TrajectoryReader trajectory(options.input);
  const Scene scene = parse_scene(trajectory.header().resolved_scene,
                                  std::filesystem::path(options.input) / "trajectory.zarr")
                          .scene;
  ExportJob job{.output = options.output,
                .choice = {.frames = chosen_frames(options, trajectory),
                           .only = options.only,
                           .camera = scene.camera},
                .form = options.form,
                .aspect = static_cast<double>(scene.render.size[0]) / scene.render.size[1],
                .part_bytes = options.part_bytes,
                .force = options.force};
  if (options.no_camera) {
    job.choice.camera.keys.clear();
  } else if (job.choice.camera.keys.empty()) {
    job.choice.camera.keys.push_back(frame_action(trajectory, job.aspect));
  }
  const ExportSummary summary = run_export(trajectory, job);
  if (options.quiet) return;
  std::string files;
  for (const auto& [name, bytes] : summary.files) {
    files += (files.empty() ? "" : ", ") + name.string() + " (" + size_text(bytes) + ')';
  }
  print("%s: %s, %zu of them moving, in %s; %.1f s\n", files.c_str(),
        counted(summary.bodies, "body", "bodies").c_str(), summary.moving,
        counted(summary.frames, "frame").c_str(), summary.wall_s);
}

}  // namespace

void add_export_command(CLI::App& app) {
  auto options = std::make_shared<ExportArguments>();
  CLI::App* command = app.add_subcommand(
      "export", "Write a trajectory for USD, glTF, Blender, numpy or as a table");
  command->add_option("input", options->input, "The directory of a run")
      ->required()
      ->type_name("DIRECTORY")
      ->check(named(), "");
  command
      ->add_option("-o,--output", options->output,
                   "The file; its ending says which format: .usda, .glb, .gltf (and .bin beside "
                   "it), .vat.glb (a vertex animation for game engines, with two .exr and .json), "
                   ".py (a script for Blender, and .npz beside it), .npz or .csv")
      ->required()
      ->type_name("FILE");
  CLI::Option* frames =
      command
          ->add_option_function<std::string>(
              "--frames",
              [options](const std::string& text) { options->frames = parse_frame_range(text); },
              std::string("Frames to take: ") + kFramesHelp + " (default: all)")
          ->type_name("FIRST-LASTxSTEP");
  CLI::Option* every = add_whole_number(
      *command, "--every", {1, 1'000'000}, [options](uint64_t n) { options->every = n; },
      "Take every N-th frame only; the speed stays the same");
  every->excludes(command
                      ->add_option_function<std::string>(
                          "--frame",
                          [options](const std::string& text) {
                            const FramePoint point = parse_frame_point(text, "--frame");
                            options->frames = {.first = point, .last = point};
                            options->option = "--frame";
                          },
                          "Take one frame: 7, last, -2 or 2.5s")
                      ->type_name("FRAME")
                      ->excludes(frames));
  command
      ->add_option("--only", options->only,
                   "Only bodies of these names; * and ? are wildcards: 'spout/*' (repeatable)")
      ->type_name("NAME")
      ->allow_extra_args(false);
  add_choice<ExportForm>(
      *command, "--as", {{"objects", ExportForm::objects}, {"instances", ExportForm::instances}},
      options->form,
      "objects: one for each body, with keys where it moves (default up to 1,000 bodies, and in "
      "moving glTF); instances: one object for many bodies");
  add_whole_number(
      *command, "--part-bytes", {1000, 2'147'483'647},
      [options](uint64_t n) { options->part_bytes = n; },
      "Motion of more bytes than about this goes into several files: value clips of .usda "
      "(default: 268435456), .bin of .gltf (default: 2147483647)");
  command->add_flag("--no-camera", options->no_camera, "Omit the camera");
  command->add_flag("--quiet,-q", options->quiet, "Print nothing but errors");
  command->add_flag("--force", options->force, "Replace files that exist");
  command->footer(R"(
Examples:
  pilesim export out/crate -o crate.usda
  pilesim export out/crate -o crate.glb --every 2
  pilesim export out/crate -o last.glb --frame last
  pilesim export out/crate -o crate.vat.glb
  pilesim export out/crate -o crate.py && blender --python crate.py
  pilesim export out/crate -o spout.csv --only 'front spout/*' --frames 30-90)");
  command->callback([options] { run_export_command(*options); });
}

}  // namespace pilesim
