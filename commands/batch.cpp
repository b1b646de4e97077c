#include "batch/batch.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "batch/slurm.h"
#include "core/counted.h"
#include "core/error.h"
#include "numbers.h"
#include "options.h"
#include "print.h"

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

// "2.5 h", "40 s".
std::string duration_text(double seconds) {
  char text[32];
  if (seconds < 120) {
    std::snprintf(text, sizeof text, "%.3g s", seconds);
  } else if (seconds < 7200) {
    std::snprintf(text, sizeof text, "%.3g min", seconds / 60);
  } else if (seconds < 1e6) {
    std::snprintf(text, sizeof text, "%.4g h", seconds / 3600);
  } else {
    std::snprintf(text, sizeof text, "%.4g days", seconds / 86400);
  }
  return text;
}

std::string bytes_text(double bytes) {
  char text[32];
  if (bytes < 1e9) {
    std::snprintf(text, sizeof text, "%.3g MB", bytes / 1e6);
  } else if (bytes < 1e12) {
    std::snprintf(text, sizeof text, "%.4g GB", bytes / 1e9);
  } else {
    std::snprintf(text, sizeof text, "%.4g TB", bytes / 1e12);
  }
  return text;
}

void print_forecast(const BatchOptions& options, const BatchForecast& forecast) {
  print("%s: %s, %llu of them done, %llu to do\n", options.output.c_str(),
        counted(forecast.jobs, "job").c_str(), static_cast<unsigned long long>(forecast.done),
        static_cast<unsigned long long>(forecast.jobs - forecast.done));
  if (forecast.changed > 0) {
    print("  %s of another plan: made anew with --force\n",
          counted(forecast.changed, "job is", "jobs are").c_str());
    for (const std::string& change : forecast.changes) print("    %s\n", change.c_str());
  }
  if (forecast.sample == 0 || forecast.jobs == forecast.done) return;
  print(
      "  by %s: %s of processor time (%s a job), %s here, %s of disk in %.0f files, %s of memory a "
      "job\n",
      counted(forecast.sample, "job that was measured", "jobs that were measured").c_str(),
      duration_text(forecast.processor_s).c_str(), duration_text(forecast.processor_s_each).c_str(),
      duration_text(forecast.wall_s).c_str(), bytes_text(forecast.bytes).c_str(), forecast.files,
      bytes_text(static_cast<double>(forecast.peak_memory_bytes)).c_str());
}

// What a cluster takes, and what it asks of the disk that its nodes share.
void print_cluster(const BatchOptions& options, const BatchForecast& forecast) {
  if (!options.nodes || forecast.sample == 0 || forecast.jobs == forecast.done) return;
  const double cores = static_cast<double>(*options.nodes * options.cores_each);
  const double to_do = static_cast<double>(forecast.jobs - forecast.done);
  // No job is shared.
  const double wall_s = std::ceil(to_do / cores) * forecast.processor_s_each;
  print("  on %s of %s: %s; %s of memory a node; %.3g files and %s a second into the shared disk\n",
        counted(*options.nodes, "node").c_str(), counted(options.cores_each, "core").c_str(),
        duration_text(wall_s).c_str(),
        bytes_text(static_cast<double>(forecast.peak_memory_bytes * options.cores_each)).c_str(),
        forecast.files / wall_s, bytes_text(forecast.bytes / wall_s).c_str());
}

void print_collected(const BatchSummary& summary) {
  const CollectionSummary& all = summary.collected;
  if (all.pictures > 0) {
    print("  coco.json: %s, %s\n", counted(all.pictures, "picture").c_str(),
          counted(all.annotations, "mask").c_str());
  }
  if (all.scenes > 0) {
    print("  bop: %s, %s\n", counted(all.scenes, "scene").c_str(),
          counted(all.models, "model").c_str());
  }
  if (all.tars > 0) {
    print("  tar: %s, %s of %s\n", counted(all.tars, "file").c_str(),
          counted(all.samples, "sample").c_str(), counted(all.packed, "job").c_str());
  }
}

void print_batch(const BatchOptions& options, const BatchSummary& summary) {
  if (options.quiet) return;
  const uint64_t now = summary.done + summary.not_done() -
                       std::min(summary.of_before, summary.done + summary.not_done());
  print("%s: %llu of %s done", options.output.c_str(),
        static_cast<unsigned long long>(summary.done), counted(summary.jobs, "job").c_str());
  if (summary.of_before > 0) {
    print(", %llu of them by an earlier run", static_cast<unsigned long long>(summary.of_before));
  }
  if (summary.tried_again > 0) {
    print(", %llu tried again", static_cast<unsigned long long>(summary.tried_again));
  }
  if (summary.elsewhere > 0) {
    print(", %llu under way in another process",
          static_cast<unsigned long long>(summary.elsewhere));
  }
  print("; %s", duration_text(summary.wall_s).c_str());
  if (now > 0 && summary.wall_s > 0 && !options.collect) {
    print(", %.3g jobs a minute, %.0f %% of %s", 60 * static_cast<double>(now) / summary.wall_s,
          100 * summary.processor_s / summary.wall_s / summary.cores,
          counted(static_cast<unsigned>(summary.cores), "core").c_str());
  }
  print("\n");
  print_collected(summary);
}

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
                      .remedy = "table.csv has what each said; --retry tries them again"});
}

void run_batch_command(BatchOptions& options) {
  options.request.plan_file = options.plan;
  options.request.output = options.output;
  if (options.dry_run || options.slurm) {
    const BatchForecast forecast = forecast_batch(options.request, options.sample);
    if (!options.quiet) {
      print_forecast(options, forecast);
      print_cluster(options, forecast);
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
  print_batch(options, summary);
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
      ->check(named(), "");
  command
      ->add_option("-o,--output", options->output,
                   "Directory for jobs/, index.jsonl and table.csv; what is done there is kept")
      ->required()
      ->type_name("DIRECTORY");
  CLI::Option* dry_run = command->add_flag(
      "--dry-run", options->dry_run,
      "Print how many jobs there are, what has changed, and what they will take, and stop");
  add_whole_number(
      *command, "--sample", {1, 1000}, [options](uint64_t n) { options->sample = n; },
      "Jobs that --dry-run and --slurm measure where none is done yet; default: 2");
  CLI::Option* nodes = add_whole_number(
      *command, "--nodes", {1, 1'000'000}, [options](uint64_t n) { options->nodes = n; },
      "With --dry-run: what so many nodes of a cluster will take");
  nodes->needs(dry_run);
  add_whole_number(
      *command, "--cores", {1, 1024}, [options](uint64_t n) { options->cores_each = n; },
      "With --nodes: that a node has; default: 1")
      ->needs(nodes);
  add_whole_number(
      *command, "--processes", {1, 1024},
      [options](uint64_t n) { options->request.processes = static_cast<int>(n); },
      "Jobs at once; default: as many as cores and memory allow");
  command->add_flag("--retry", options->request.retry, "Try again what failed");
  command->add_flag("--force", options->request.force, "Make anew what the plan has changed");
  CLI::Option* shard =
      command
          ->add_option_function<std::string>(
              "--shard",
              [options](const std::string& text) { options->request.shard = parse_shard(text); },
              "Do this part of the jobs only, for schedulers of your own: 3/40 is the fourth of 40")
          ->type_name("INDEX/COUNT");
  CLI::Option* collect = command->add_flag(
      "--collect", options->collect,
      "Run nothing; make index.jsonl, table.csv and what the plan collects of what "
      "is there");
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
      "With --slurm: what a task should take, by the sample; default: 10")
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
again with another seed as often as the plan says; the exit code is 5 where one is not done at last.)");
  command->callback([options] {
    if (options->quiet) options->request.progress = ProgressMode::none;
    run_batch_command(*options);
  });
}

}  // namespace pilesim
