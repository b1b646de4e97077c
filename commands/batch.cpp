#include "batch/batch.h"

#include <memory>
#include <optional>

#include "batch/slurm.h"
#include "core/counted.h"
#include "core/error.h"
#include "numbers.h"
#include "options.h"
#include "print.h"
#include "print_batch.h"

namespace pilesim {
namespace {

struct BatchOptions {
  BatchRequest request;
  std::string plan, output;
  bool quiet = false, dry_run = false, collect = false, slurm = false, no_submit = false;
  uint64_t sample = 2;
  std::optional<uint64_t> nodes;
  uint64_t cores_each = 1;  // of a node
  SlurmChoice cluster;
};

void throw_not_done(const BatchOptions& options, const BatchSummary& summary) {
  if (summary.not_done() == 0) return;
  std::string found = std::to_string(summary.not_done()) + " of " + counted(summary.jobs, "job") +
                      " could not be done:";
  const auto add = [&](uint64_t count, const char* what) {
    if (count > 0) found += ' ' + std::to_string(count) + what + ',';
  };
  add(summary.gate, " failed a quality gate");
  add(summary.failed, " failed");
  add(summary.died, " died");
  add(summary.too_long, " took too long");
  found.pop_back();
  throw Error(ErrorKind::quality,
              Problem{.file = options.output,
                      .found = found,
                      .remedy = "table.csv has their messages; --retry tries them again"});
}

void run_batch_command(BatchOptions& options) {
  options.request.plan_file = options.plan;
  options.request.output = options.output;
  if (options.dry_run || options.slurm) {
    const BatchForecast forecast = forecast_batch(options.request, options.sample);
    if (!options.quiet) {
      print_forecast(options.output, forecast);
      if (options.nodes) print_cluster(*options.nodes, options.cores_each, forecast);
    }
    if (options.dry_run) return;
    options.cluster.submit = !options.no_submit;
    const SlurmSubmission submission = submit_to_slurm(options.request, forecast, options.cluster);
    if (options.quiet) return;
    print("  %s of about %.0f minutes at most and %llu MB: %s/slurm/array.sh\n",
          counted(submission.tasks, "task").c_str(), submission.minutes_asked,
          static_cast<unsigned long long>(submission.megabytes_asked), options.output.c_str());
    if (!submission.array_id.empty()) {
      print("  submitted: job %s, then %s collects\n", submission.array_id.c_str(),
            submission.collect_id.c_str());
    }
    return;
  }
  const BatchSummary summary =
      options.collect ? collect_batch(options.request) : run_batch(options.request);
  if (!options.quiet) print_batch(options.output, summary, !options.collect);
  throw_not_done(options, summary);
}

Shard parse_shard(const std::string& text) {
  const size_t slash = text.find('/');
  if (slash == text.npos) {
    throw CLI::ValidationError("--shard", "'" + text + "' is not INDEX/COUNT, such as 0/40");
  }
  Shard shard;
  shard.count = parse_whole_number(text.substr(slash + 1), {1, 1'000'000}, "--shard");
  shard.index = parse_whole_number(text.substr(0, slash), {0, shard.count - 1}, "--shard");
  return shard;
}

}  // namespace

void add_batch_command(CLI::App& app) {
  auto options = std::make_shared<BatchOptions>();
  CLI::App* command =
      app.add_subcommand("batch", "Make many runs of a scene that varies, here or on a cluster");
  command->add_option("plan", options->plan, "The plan (JSON): docs/batch.md")
      ->required()
      ->type_name("FILE")
      ->check(named(), "");
  command
      ->add_option(
          "-o,--output", options->output,
          "Directory for jobs/, index.jsonl and table.csv; jobs that are done there are kept")
      ->required()
      ->type_name("DIRECTORY");
  CLI::Option* dry_run = command->add_flag("--dry-run", options->dry_run,
                                           "Print the number of jobs, their changes, and the time "
                                           "and disk that they will take, and stop");
  add_whole_number(
      *command, "--sample", {1, 1000}, [options](uint64_t n) { options->sample = n; },
      "Jobs that --dry-run and --slurm measure if none is done yet; default: 2");
  CLI::Option* nodes = add_whole_number(
      *command, "--nodes", {1, 1'000'000}, [options](uint64_t n) { options->nodes = n; },
      "With --dry-run: an estimate for N nodes of a cluster");
  nodes->needs(dry_run);
  add_whole_number(
      *command, "--cores", {1, 1024}, [options](uint64_t n) { options->cores_each = n; },
      "With --nodes: cores of a node; default: 1")
      ->needs(nodes);
  add_whole_number(
      *command, "--processes", {1, 1024},
      [options](uint64_t n) { options->request.processes = static_cast<int>(n); },
      "Parallel jobs; default: as many as cores and memory allow");
  command->add_flag("--retry", options->request.retry, "Try failed jobs again");
  command->add_flag("--force", options->request.force, "Make jobs again that the plan has changed");
  CLI::Option* shard =
      command
          ->add_option_function<std::string>(
              "--shard",
              [options](const std::string& text) { options->request.shard = parse_shard(text); },
              "Do only this part of the jobs, for other schedulers: 3/40 is the fourth of 40")
          ->type_name("INDEX/COUNT");
  CLI::Option* collect = command->add_flag(
      "--collect", options->collect,
      "Run nothing; make index.jsonl, table.csv and the plan's datasets from the finished jobs");
  CLI::Option* slurm = command->add_flag(
      "--slurm", options->slurm,
      "Submit the batch to Slurm as an array job, and its collection after it, and stop");
  CLI::Option* no_submit =
      command->add_flag("--no-submit", options->no_submit, "With --slurm: write the scripts only");
  command
      ->add_option(
          "--slurm-option", options->cluster.options,
          "With --slurm: a further option of sbatch, such as --partition=long (repeatable)")
      ->type_name("OPTION")
      ->allow_extra_args(false)
      ->needs(slurm);
  no_submit->needs(slurm);
  add_real_number(
      *command, "--task-minutes", {.least = 0.01, .most = 10'000},
      [options](double minutes) { options->cluster.minutes_each = minutes; },
      "With --slurm: time of a task, estimated by the sample; default: 10")
      ->needs(slurm);
  slurm->excludes(dry_run)->excludes(shard)->excludes(collect);
  collect->excludes(dry_run)->excludes(shard);
  dry_run->excludes(shard);
  add_choice<ProgressMode>(*command, "--progress",
                           {{"auto", ProgressMode::automatic},
                            {"bar", ProgressMode::bar},
                            {"json", ProgressMode::json},
                            {"none", ProgressMode::none}},
                           options->request.progress,
                           "auto (default: a bar where stderr is a terminal), bar, json or none");
  command->add_flag("--quiet,-q", options->quiet, "Print nothing but errors");
  command->footer(R"(
Examples:
  pilesim batch presets/batch/bins.plan.json -o out/bins --dry-run
  pilesim batch presets/batch/bins.plan.json -o out/bins
  pilesim batch plan.json -o /shared/bins --slurm --slurm-option=--partition=long
  pilesim batch plan.json -o /shared/bins --shard 3/40

A batch that was interrupted or killed goes on with the same command. Jobs that fail a gate are tried
again with another seed as often as the plan says. The exit code is 5 if one is not done in the end.)");
  command->callback([options] {
    if (options->quiet) options->request.progress = ProgressMode::none;
    run_batch_command(*options);
  });
}

}  // namespace pilesim
