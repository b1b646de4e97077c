// Tables and figures of the dissertation by their numbers.
#include <memory>

#include "core/text.h"
#include "installed.h"
#include "job/reproduction_job.h"
#include "options.h"
#include "print.h"

namespace pilesim {
namespace {

struct ReproduceArguments {
  std::vector<std::string> names;
  std::string output;
  bool full = false, dry_run = false, quiet = false, force = false, resume = false;
};

std::string time_text(std::optional<double> seconds) {
  return seconds ? with_digits(*seconds, *seconds < 10 ? 2 : 3) + " s" : "-";
}

void list(const Reproduction& reproduction) {
  print("%-12s %-9s %7s %7s  %s\n", "number", "kind", "quick", "full", "title");
  for (const ReproductionEntry& entry : reproduction.entries) {
    const bool runs = !entry.runs.empty();
    const auto time = [&](ReproductionSize size) {
      return runs ? time_text(measured_s(reproduction, entry, size)) : std::string();
    };
    print("%-12s %-9s %7s %7s  %s\n", entry.number.c_str(), entry.kind.c_str(),
          time(ReproductionSize::quick).c_str(), time(ReproductionSize::full).c_str(),
          entry.title.c_str());
  }
}

void print_commands(const Reproduction& reproduction,
                    const std::vector<const ReproductionEntry*>& entries, ReproductionSize size,
                    const std::string& output) {
  for (const ReproductionRun* run : runs_of(reproduction, entries)) {
    print_line(command_line(*run, size, output.empty() ? "out" : output));
  }
}

void reproduce(const ReproduceArguments& options) {
  const std::filesystem::path directory = installed_directory("reproduce");
  const Reproduction reproduction = read_reproduction(directory);
  if (options.names.front() == "list") return list(reproduction);
  const auto entries = chosen_entries(reproduction, options.names);
  const ReproductionSize size = options.full ? ReproductionSize::full : ReproductionSize::quick;
  if (options.dry_run) return print_commands(reproduction, entries, size, options.output);
  const std::string missing = run_reproduction(reproduction, entries,
                                               {.size = size,
                                                .output = options.output,
                                                .program = "/proc/self/exe",
                                                .directory = directory.parent_path(),
                                                .force = options.force,
                                                .resume = options.resume,
                                                .tell = [&](const std::string& line) {
                                                  if (!options.quiet) print_line(line);
                                                }});
  if (options.quiet) return;
  if (!missing.empty()) warn(missing);
  print("%s/reproduction.html has it all\n", options.output.c_str());
}

}  // namespace

void add_reproduce_command(CLI::App& app) {
  auto options = std::make_shared<ReproduceArguments>();
  CLI::App* command = app.add_subcommand(
      "reproduce", "Make tables and figures of the dissertation again, by their numbers");
  command
      ->add_option("names", options->names,
                   "list, or which: table 3.1, figure 5.9, chapter 6, all (several are possible)")
      ->required()
      ->type_name("NAME ...");
  CLI::Option* output =
      command
          ->add_option("-o,--output", options->output,
                       "Directory for reproduction.html, .md and .json, charts/ and runs/; "
                       "required except with list and --dry-run")
          ->type_name("DIRECTORY");
  command->add_flag("--full", options->full,
                    "In the dissertation's sizes, which may take hours, instead of small ones");
  command->add_flag("--dry-run", options->dry_run, "Print the commands, and stop");
  command->add_flag("--quiet,-q", options->quiet, "Print nothing but errors");
  CLI::Option* force = command->add_flag("--force", options->force, "Replace output that exists");
  command
      ->add_flag("--resume", options->resume,
                 "Keep the finished runs of the same commands and program")
      ->excludes(force);
  command->footer(R"(
Examples:
  pilesim reproduce list
  pilesim reproduce table 3.1 -o out/table
  pilesim reproduce chapter 6 --full -o out/piles
  pilesim reproduce figure 5.9 --dry-run

Times of the list are processor times on one machine; signatures that are not cached take longer.
The page has the dissertation's numbers beside pilesim's, pictures, and the commands, which run
where presets/ is. After Ctrl-C the same command with --resume goes on.)");
  command->callback([options, output] {
    if (options->names.front() != "list" && !options->dry_run && output->empty()) {
      throw CLI::RequiredError("-o,--output");
    }
    reproduce(*options);
  });
}

}  // namespace pilesim
