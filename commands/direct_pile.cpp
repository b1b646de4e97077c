#include <cstdio>
#include <memory>

#include "job/guide_job.h"
#include "options.h"

namespace pilesim {
namespace {

struct Options {
  SceneOptions scene;
  RunOptions run;
  std::string output;
};

void direct_pile(const Options& options) {
  const GuideSummary summary =
      run_guided({.scene_file = options.scene.file,
                  .output = options.output,
                  .overrides = options.scene.overrides,
                  .force = options.run.force,
                  .progress = options.run.quiet ? ProgressMode::none : options.run.progress});
  if (options.run.quiet) return;
  const SimulationSummary& simulation = summary.simulation;
  for (const std::string& line : simulation.warnings) {
    std::fprintf(stderr, "pilesim: warning: %s\n", line.c_str());
  }
  std::printf("%s: %llu frames (%.2f s) of %llu bodies in %.1f s; control %.1f %% of it\n",
              options.output.c_str(), static_cast<unsigned long long>(simulation.frames),
              simulation.simulated_s, static_cast<unsigned long long>(simulation.bodies),
              simulation.wall_s, 100 * summary.control_share);
  const GuideFrame& last = summary.last;
  std::printf(
      "at the end: %u held, %u passed, %u filtered, %u failed; height %.3g m, mean drift "
      "%.2g m\n",
      last.counts.held, last.counts.passed, last.counts.filtered, last.counts.failed, last.height_m,
      last.mean_drift_m);
  if (summary.fit.voxel_m == 0) return;
  std::printf("in the guide: %.1f %% of the bodies, %.1f %% of their volume; overlap %.1f %%\n",
              100 * summary.fit.bodies_inside, 100 * summary.fit.volume_inside,
              100 * summary.fit.overlap);
}

}  // namespace

void add_direct_pile_command(CLI::App& app) {
  auto options = std::make_shared<Options>();
  CLI::App* command =
      app.add_subcommand("direct-pile", "Simulate a scene whose guide keeps a pile in its shape");
  add_scene_options(*command, options->scene);
  command
      ->add_option("-o,--output", options->output,
                   "Directory for what simulate writes, and guide.json")
      ->required();
  add_run_options(*command, options->run);
  command->footer(R"(
Examples:
  pilesim direct-pile presets/equilibrium/card_tower.json -o out/cards
  pilesim direct-pile presets/equilibrium/card_tower.json -o out/free --set /guide/control=false)");
  command->callback([options] { direct_pile(*options); });
}

}  // namespace pilesim
