#include <algorithm>
#include <filesystem>
#include <memory>

#include "core/output_directory.h"
#include "core/text.h"
#include "frame_range.h"
#include "job/run_model.h"
#include "job/run_overlaps.h"
#include "numbers.h"
#include "options.h"
#include "print.h"
#include "render/scene_renderer.h"
#include "trajectory/trajectory.h"
#include "view/view_job.h"

namespace pilesim {
namespace {

namespace fs = std::filesystem;

// Bodies that a browser moves and draws 30 times a second.
constexpr uint64_t kMostBodies = 10'000;

struct ViewArguments {
  std::string input;
  std::optional<std::string> output;
  FrameRange frames;
  std::vector<std::string> only;
  uint64_t bodies = kMostBodies;
  bool overlaps = false;
  std::optional<std::string> scene;
  bool force = false, quiet = false;
};

// The directory that holds the trajectory, which may be named itself.
fs::path run_directory(const fs::path& input) {
  if (fs::exists(input / "trajectory.zarr")) return input;
  return input.has_filename() ? input.parent_path() : input.parent_path().parent_path();
}

// "10,000 of 100,000 bodies"
std::string part_of(size_t shown, size_t all, const std::string& what) {
  return grouped(shown) + (shown < all ? " of " + grouped(all) : "") + ' ' + what;
}

void run_view_command(const ViewArguments& options) {
  TrajectoryReader trajectory(options.input);
  const Scene scene = stored_scene(trajectory.header(), options.input);
  const fs::path directory = run_directory(options.input);
  ViewJob job{.output = options.output ? fs::path(*options.output) : directory / kViewFile,
              .beside = directory,
              .choice = {.frames = selected_frames(options.frames, trajectory.frame_count(),
                                                   trajectory.header().frame_rate),
                         .only = options.only,
                         .camera = scene.camera},
              .title = scene.name,
              .mode = mode_name(scene.simulator.mode),
              .render = scene.render,
              .most_bodies = options.bodies,
              .force = options.force};
  if (job.choice.camera.keys.empty()) {
    job.choice.camera.keys.push_back(frame_action(trajectory, 16.0 / 9));
  }
  std::optional<RunOverlaps> overlaps;
  if (options.overlaps) {
    overlaps.emplace(directory, trajectory, options.scene);
    job.overlaps = {.of = [&](uint64_t frame) { return overlaps->of(frame); },
                    .diameter_m = overlaps->diameter_m()};
  }
  const ViewSummary summary = run_view(trajectory, job);
  if (options.quiet) return;
  print("%s (%s): %s, %s; %.1f s\n", job.output.c_str(), size_text(summary.bytes).c_str(),
        part_of(summary.bodies, summary.all_bodies, "bodies").c_str(),
        part_of(summary.frames, summary.all_frames, "frames").c_str(), summary.wall_s);
}

}  // namespace

void add_view_command(CLI::App& app) {
  auto options = std::make_shared<ViewArguments>();
  CLI::App* command = app.add_subcommand(
      "view",
      "Write a page that plays a trajectory in a browser, without a network or other files");
  command->add_option("input", options->input, "The directory of a run")
      ->required()
      ->type_name("DIRECTORY")
      ->check(named(), "");
  command->add_option("-o,--output", options->output, "The page (default: view.html in the input)")
      ->type_name("FILE")
      ->check(named(), "");
  command
      ->add_option_function<std::string>(
          "--frames",
          [options](const std::string& text) { options->frames = parse_frame_range(text); },
          std::string("Frames to take: ") + kFramesHelp + " (default: all)")
      ->type_name("FIRST-LASTxSTEP");
  command
      ->add_option("--only", options->only,
                   "Only bodies of these names; * and ? are wildcards: 'spout/*' (repeatable)")
      ->type_name("NAME")
      ->allow_extra_args(false);
  add_whole_number(
      *command, "--bodies", {1, 1'000'000}, [options](uint64_t n) { options->bodies = n; },
      "Show at most N moving bodies (default " + std::to_string(kMostBodies) +
          "), spread evenly over all of them; the page says so");
  CLI::Option* overlaps =
      command->add_flag("--overlaps", options->overlaps,
                        "Measure the penetration of each body, as a colour; in large and long runs "
                        "only at evenly spread moments, which the page says");
  command
      ->add_option("--scene", options->scene,
                   "With --overlaps: the scene file of the run, if it has moved")
      ->type_name("FILE")
      ->check(named(), "")
      ->needs(overlaps);
  command->add_flag("--quiet,-q", options->quiet, "Print nothing but errors");
  command->add_flag("--force", options->force, "Replace a page that exists");
  command->footer(R"(
Examples:
  pilesim view out/crate
  pilesim view out/crate -o crate.html --frames 30-
  pilesim view out/crate --overlaps --force
  pilesim view out/flood --bodies 30000)");
  command->callback([options] { run_view_command(*options); });
}

}  // namespace pilesim
