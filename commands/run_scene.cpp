#include "run_scene.h"

#include <memory>
#include <optional>

#include "job/simulation_job.h"
#include "numbers.h"
#include "print.h"
#include "print_summary.h"
#include "scene/scene_loader.h"

namespace pilesim {
namespace {

struct Options {
  SceneOptions scene;
  RunOptions run;
  ReportOptions report;
  std::string output;
  std::optional<std::string> from;
  std::optional<uint64_t> take;
  ResumeOptions resume;
  bool print_config = false;
  bool direct_piles = false;
};

void run(const Options& options) {
  if (options.print_config) {
    print("%s\n", load_scene(options.scene.file, options.scene.overrides.texts).resolved.c_str());
    return;
  }
  const SimulationSummary summary =
      run_simulation({.scene_file = options.scene.file,
                      .output = options.output,
                      .overrides = options.scene.overrides.texts,
                      .force = options.run.force,
                      .resume = options.resume.resume,
                      .checkpoint_period_s = options.resume.checkpoint_period_s,
                      .from = options.from,
                      .take = options.take,
                      .gates = options.report.gates(),
                      .inspect_every = options.report.inspect_every,
                      .warn = options.run.quiet ? std::function<void(const std::string&)>() : warn,
                      .progress = options.run.quiet ? ProgressMode::none : options.run.progress,
                      .direct_piles = options.direct_piles,
                      .picture = !options.report.no_picture});
  if (!options.run.quiet) print_summary(options.output, summary);
}

}  // namespace

void add_run_scene_command(CLI::App& app, const RunSceneText& text) {
  auto options = std::make_shared<Options>();
  options->direct_piles = text.direct_piles;
  CLI::App* command = app.add_subcommand(text.name, text.description);
  add_scene_options(*command, options->scene);
  CLI::Option* output =
      command
          ->add_option("-o,--output", options->output,
                       "Directory for trajectory.zarr, timing.csv, report.json, report.html; "
                       "required except with --print-config")
          ->type_name("DIRECTORY");
  CLI::Option* print =
      command->add_flag("--print-config", options->print_config,
                        "Print the scene as it would run, with every default, and stop");
  print->excludes(output);
  add_report_options(*command, options->report);
  CLI::Option* from = command
                          ->add_option("--from", options->from,
                                       "The directory of a run of simulate or direct-pile: bodies "
                                       "begin as the bodies of the same names ended there")
                          ->type_name("DIRECTORY")
                          ->check(named(), "");
  add_whole_number(
      *command, "--take", {0, 100'000'000}, [options](uint64_t n) { options->take = n; },
      "With --from: remove the N highest bodies; no others are poured")
      ->needs(from);
  add_run_options(*command, options->run);
  add_resume_options(*command, options->resume)->excludes(print);
  command->footer(text.footer);
  command->callback([options, output, print] {
    if (output->empty() && print->empty()) throw CLI::RequiredError("-o,--output");
    with_options_named(options->scene.overrides, [&] { run(*options); });
  });
}

}  // namespace pilesim
