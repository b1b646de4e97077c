// The whole of `pilesim reproduce`: runs what makes chosen tables and figures, and writes the
// dissertation's numbers beside ours.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "job/reproduction_entries.h"

namespace pilesim {

struct ReproductionJob {
  ReproductionSize size = ReproductionSize::quick;
  std::filesystem::path output;
  std::filesystem::path program;  // pilesim itself, which runs each command
  // Commands run here, so that they name presets/ and assets/ wherever these are installed.
  std::filesystem::path directory;
  bool force = false;   // replace earlier results
  bool resume = false;  // keep the runs of the same command, size and program
  std::function<void(const std::string&)> tell;  // one line before each run
};

// "pilesim compare presets/… -o out/runs/NAME", as a user would write it.
std::string command_line(const ReproductionRun& run, ReproductionSize size,
                         const std::filesystem::path& output);

// The files that it writes: numbers, pages, charts/, and a directory in runs/ for each run.
inline constexpr std::string_view kReproductionEntries[] = {
    "reproduction.json", "reproduction.html", "reproduction.md", "charts", "runs"};

// Runs the commands one after the other. Where gnuplot is missing there are no charts, and what is
// returned says why; else it is empty. Throws what a command throws, naming it and the entry;
// Error(input) where a result has no such number; Error(interrupted) after Ctrl-C; and as
// claim_output() does.
std::string run_reproduction(const Reproduction& reproduction,
                             const std::vector<const ReproductionEntry*>& entries,
                             const ReproductionJob& job);

}  // namespace pilesim
