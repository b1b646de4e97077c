#include "job/finish_job.h"

#include <memory>
#include <optional>

#include "numbers.h"
#include "options.h"
#include "print_summary.h"

namespace pilesim {
namespace {

struct FinishOptions {
  RunOptions run;
  ResumeOptions resume;
  ReportOptions report;
  std::string input, output;
  std::optional<std::string> scene;
  std::optional<double> longest_s;
  bool visible_only = false;
};

void finish(const FinishOptions& options) {
  FinishJob job{.input = options.input,
                .output = options.output,
                .force = options.run.force,
                .resume = options.resume.resume,
                .checkpoint_period_s = options.resume.checkpoint_period_s,
                .longest_s = options.longest_s,
                .visible_only = options.visible_only,
                .gates = options.report.gates(),
                .inspect_every = options.report.inspect_every,
                .picture = !options.report.no_picture,
                .progress = options.run.quiet ? ProgressMode::none : options.run.progress};
  if (options.scene) job.scene_file = *options.scene;
  const SimulationSummary summary = run_finish(job);
  if (!options.run.quiet) print_summary(options.output, summary);
}

}  // namespace

void add_finish_command(CLI::App& app) {
  auto options = std::make_shared<FinishOptions>();
  CLI::App* command =
      app.add_subcommand("finish", "Take the overlaps out of the pile at the end of a run");
  command->add_option("run", options->input, "The directory of a run of simulate or direct-pile")
      ->required()
      ->type_name("DIRECTORY")
      ->check(named(), "");
  command
      ->add_option("-o,--output", options->output,
                   "Directory for trajectory.zarr, timing.csv, report.json, report.html")
      ->required()
      ->type_name("DIRECTORY");
  command
      ->add_option("--scene", options->scene,
                   "The scene file of the run, if it has moved; its meshes are read relative to it")
      ->type_name("FILE")
      ->check(named(), "");
  add_real_number(
      *command, "--longest", {1e-3, 1e6},
      [options](double longest_s) { options->longest_s = longest_s; },
      "Longest simulated time in which bodies come to rest, s (default: 100 sqrt(r / g) of the "
      "smallest body)");
  command->add_flag("--visible-only", options->visible_only,
                    "Leave overlaps of bodies that lie too deep in the pile to be seen");
  add_report_options(*command, options->report);
  add_run_options(*command, options->run);
  add_resume_options(*command, options->resume);
  command->footer(R"(
Examples:
  pilesim finish out/a -o out/sound
  pilesim finish out/a -o out/sound --fail-on "penetration>0.02D,floating>0,unsettled>0,escaped>0"
  pilesim finish out/a -o out/sound --resume
  pilesim finish out/from_elsewhere -o out/sound --scene scene.json
  pilesim render out/sound

The exact engine brings the last state of the run to rest, and each body's motion is eased to end
there; flight does not change (docs/finish.md). "finish": {} in a scene does the same at the end of
simulate and direct-pile.
Ctrl-C stops with a valid result, which says how far it is, and --resume goes on from there.)");
  command->callback([options] { finish(*options); });
}

}  // namespace pilesim
