#include <cmath>
#include <memory>

#include "job/comparison_job.h"
#include "numbers.h"
#include "options.h"
#include "print.h"

namespace pilesim {
namespace {

struct CompareArguments {
  SceneOptions scene;
  RunOptions run;
  ComparisonJob job;
  std::string output;
};

void print_mode(const ComparisonSummary::Line& line) {
  print("%-32s %8.3g (%.3g to %.3g)", line.mode.c_str(), line.speed_up, line.speed_up_low,
        line.speed_up_high);
  if (std::isfinite(line.error)) {
    print("   %8.3g (%.3g to %.3g), %s", line.error, line.error_low, line.error_high,
          line.quantity.c_str());
  }
  print("\n");
}

void compare(CompareArguments& options) {
  ComparisonJob& job = options.job;
  job.scene_file = options.scene.file;
  job.overrides = options.scene.overrides.texts;
  job.output = options.output;
  job.program = "/proc/self/exe";
  job.force = options.run.force;
  job.progress = options.run.quiet ? ProgressMode::none : options.run.progress;
  if (!options.run.quiet) job.warn = warn;
  const ComparisonSummary summary = run_comparison(job);
  if (options.run.quiet) return;
  for (const std::string& line : summary.warnings) warn(line);
  print("mode, speed-up, largest error (1: as far as the reference is from itself)\n");
  for (const ComparisonSummary::Line& line : summary.lines) print_mode(line);
  print("%s/compare.html has it all\n", options.output.c_str());
}

}  // namespace

void add_compare_command(CLI::App& app) {
  auto options = std::make_shared<CompareArguments>();
  ComparisonJob& job = options->job;
  CLI::App* command =
      app.add_subcommand("compare", "Simulate a scene in several modes: speed against error");
  add_scene_options(*command, options->scene);
  command
      ->add_option("-o,--output", options->output,
                   "Directory for compare.json, compare.html, charts and runs/")
      ->required()
      ->type_name("DIRECTORY");
  command
      ->add_option(
          "--modes", job.modes,
          "MODE[:COLLISION[COUNT]][@STEP][+finish][+/POINTER=VALUE], with commas in between")
      ->required()
      ->type_name("MODES");
  command
      ->add_option("--reference", job.reference,
                   "The mode that others are compared with (default: impulse:decomposition, or "
                   "impulse where no dynamic body has a mesh)")
      ->check([](const std::string& text) { return text.empty() ? "the mode is empty" : ""; }, "")
      ->type_name("MODE");
  add_whole_number(
      *command, "--runs", {3, 1000}, [&job](uint64_t runs) { job.runs = static_cast<int>(runs); },
      "Seeds of each mode, from the scene's on; default: " + std::to_string(job.runs));
  add_whole_number(
      *command, "--times", {1, 1000},
      [&job](uint64_t times) { job.times = static_cast<int>(times); },
      "Moments at which distributions are compared, to the end; default: " +
          std::to_string(job.times));
  add_run_options(*command, options->run);
  command
      ->add_flag("--resume", job.resume,
                 "Keep the finished runs of an earlier comparison whose inputs have not changed")
      ->excludes("--force");
  command->footer(R"(
Examples:
  pilesim compare scene.json -o out/cmp --modes impulse,impulse:spheres7,statistical
  pilesim compare scene.json -o out/cmp --modes impulse:decomposition@1/480,statistical@1/60 --runs 8

A mode is a value of /simulator/mode, with the collision of meshes (hull40, decomposition, spheres7,
sphere) and the longest step. Each run is a simulation in out/cmp/runs and can be rendered. After
Ctrl-C the same command with --resume goes on.)");
  command->callback(
      [options] { with_options_named(options->scene.overrides, [&] { compare(*options); }); });
}

}  // namespace pilesim
