// The tables and figures of the dissertation, and the commands that make ours: the files of
// reproduce/, which say how they are written (reproduce/README.md).
#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

namespace pilesim {

enum class ReproductionSize { quick, full };

// One command of pilesim. "{out}" in its arguments is its directory of results, "{NAME}" that of
// the run NAME, which is made before.
struct ReproductionRun {
  struct Size {
    std::vector<std::string> arguments;
    std::optional<double> measured_s;  // processor time
  };
  std::string name;
  Size quick, full;
  std::vector<std::string> needs;  // names of runs

  const Size& at(ReproductionSize size) const {
    return size == ReproductionSize::full ? full : quick;
  }
};

struct ReproductionEntry {
  std::string number;   // "table 3.1"
  std::string chapter;  // "chapter 3"
  std::string kind;     // "measured", "picture", "drawing"
  std::string title;
  std::vector<std::string> runs;  // names, each after those that it needs
  nlohmann::ordered_json content;
};

struct Reproduction {
  std::vector<ReproductionEntry> entries;  // in the order of the text
  std::map<std::string, ReproductionRun> runs;
};

// Reads all .json files of `directory`, in the order of their names. Throws Error(io), and
// Error(input) where one is not as it is to be.
Reproduction read_reproduction(const std::filesystem::path& directory);

// The entries that `names` choose, each once, in the order of the text: "table 3.1", "chapter 6",
// "all"; quotes around the two words may be missing. Throws Error(usage) for other names.
std::vector<const ReproductionEntry*> chosen_entries(const Reproduction& reproduction,
                                                     const std::vector<std::string>& names);

// All their runs, each once and after those that it needs.
std::vector<const ReproductionRun*> runs_of(const Reproduction& reproduction,
                                            const std::vector<const ReproductionEntry*>& entries);

// Processor time of all its runs; none where a run has not been measured.
std::optional<double> measured_s(const Reproduction& reproduction, const ReproductionEntry& entry,
                                 ReproductionSize size);

}  // namespace pilesim
