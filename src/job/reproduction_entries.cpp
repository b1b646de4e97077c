#include "job/reproduction_entries.h"

#include <algorithm>
#include <cctype>
#include <sstream>

#include "core/error.h"
#include "json/json_text.h"
#include "json/problem_log.h"

namespace pilesim {
namespace {

namespace fs = std::filesystem;

Error fault(const std::string& place, const std::string& found, const std::string& expected) {
  return Error(ErrorKind::input, Problem{.file = place, .found = found, .expected = expected});
}

std::vector<std::string> words_of(const std::string& text) {
  std::vector<std::string> words;
  std::istringstream stream(text);
  for (std::string word; stream >> word;) words.push_back(word);
  return words;
}

ReproductionRun::Size read_size(const Json& json, const std::string& size) {
  const std::string arguments =
      json.at("command").get<std::string>() + " " + json.value(size, std::string());
  ReproductionRun::Size result{.arguments = words_of(arguments)};
  if (json.contains(size + "_s")) result.measured_s = json.at(size + "_s").get<double>();
  return result;
}

// Names in braces. JSON has braces, too: names have letters, digits and '_' only.
std::vector<std::string> needs_of(const std::vector<std::string>& arguments) {
  std::vector<std::string> names;
  for (const std::string& argument : arguments) {
    for (size_t at = argument.find('{'); at != std::string::npos; at = argument.find('{', at + 1)) {
      const size_t end = argument.find('}', at);
      if (end == std::string::npos) break;
      const std::string name = argument.substr(at + 1, end - at - 1);
      const bool is_name = std::ranges::all_of(
          name, [](unsigned char c) { return c == '_' || std::isalnum(c) != 0; });
      if (is_name && name != "out") names.push_back(name);
    }
  }
  return names;
}

void read_runs(const Json& json, const fs::path& file, Reproduction& reproduction) {
  for (const auto& [name, value] : json.items()) {
    ReproductionRun run{
        .name = name, .quick = read_size(value, "quick"), .full = read_size(value, "full")};
    run.needs = needs_of(run.full.arguments);
    for (const std::string& needed : run.needs) {
      if (reproduction.runs.contains(needed)) continue;
      throw fault(file.string(), "the run \"" + name + "\" reads \"" + needed + '"',
                  "the name of a run above it");
    }
    if (!reproduction.runs.emplace(name, std::move(run)).second) {
      throw fault(file.string(), "the run \"" + name + "\" is there twice", "each name once");
    }
  }
}

void add_with_needs(const Reproduction& reproduction, const std::string& name,
                    std::vector<std::string>& names) {
  if (std::ranges::find(names, name) != names.end()) return;
  for (const std::string& needed : reproduction.runs.at(name).needs) {
    add_with_needs(reproduction, needed, names);
  }
  names.push_back(name);
}

ReproductionEntry read_entry(const Json& json, const fs::path& file,
                             const Reproduction& reproduction) {
  ReproductionEntry entry{.number = json.at("number"),
                          .kind = json.at("kind"),
                          .title = json.at("title"),
                          .content = json};
  const size_t first = entry.number.find(' ') + 1;
  entry.chapter = "chapter " + entry.number.substr(first, entry.number.find('.') - first);
  for (const Json& name : json.value("runs", Json::array())) {
    if (!reproduction.runs.contains(name)) {
      throw fault(file.string(), entry.number + " has the run " + name.dump(),
                  "the name of one of \"runs\"");
    }
    add_with_needs(reproduction, name, entry.runs);
  }
  return entry;
}

std::string lower(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

// "table", "3.1" -> "table 3.1"
std::vector<std::string> joined_names(const std::vector<std::string>& words) {
  std::vector<std::string> names;
  for (const std::string& word : words) {
    const bool is_number = !word.empty() && std::isdigit(static_cast<unsigned char>(word[0])) != 0;
    if (is_number && !names.empty() && names.back().find(' ') == std::string::npos) {
      names.back() += ' ' + word;
    } else {
      names.push_back(lower(word));
    }
  }
  return names;
}

}  // namespace

Reproduction read_reproduction(const fs::path& directory) {
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(directory)) {
    if (entry.path().extension() == ".json") files.push_back(entry.path());
  }
  std::ranges::sort(files);
  Reproduction reproduction;
  for (const fs::path& file : files) {
    const Json json = read_json_file(file);
    try {
      read_runs(json.value("runs", Json::object()), file, reproduction);
      for (const Json& entry : json.at("entries")) {
        reproduction.entries.push_back(read_entry(entry, file, reproduction));
      }
    } catch (const nlohmann::json::exception& error) {
      throw fault(file.string(), error.what(), "entries as reproduce/README.md describes them");
    }
  }
  return reproduction;
}

std::vector<const ReproductionEntry*> chosen_entries(const Reproduction& reproduction,
                                                     const std::vector<std::string>& names) {
  std::vector<const ReproductionEntry*> chosen;
  const std::vector<std::string> wanted = joined_names(names);
  const auto is_wanted = [&](const std::string& name) {
    return std::ranges::find(wanted, name) != wanted.end();
  };
  std::vector<std::string> known = {"all"};
  for (const ReproductionEntry& entry : reproduction.entries) {
    known.push_back(entry.number);
    known.push_back(entry.chapter);
    if (is_wanted("all") || is_wanted(entry.number) || is_wanted(entry.chapter)) {
      chosen.push_back(&entry);
    }
  }
  for (const std::string& name : wanted) {
    if (std::ranges::find(known, name) != known.end()) continue;
    throw Error(ErrorKind::usage,
                Problem{.file = '"' + name + '"',
                        .found = "is not in the dissertation",
                        .expected = "a name that pilesim reproduce list has, a chapter or all",
                        .remedy = did_you_mean(name, known)});
  }
  return chosen;
}

std::vector<const ReproductionRun*> runs_of(const Reproduction& reproduction,
                                            const std::vector<const ReproductionEntry*>& entries) {
  std::vector<const ReproductionRun*> runs;
  for (const ReproductionEntry* entry : entries) {
    for (const std::string& name : entry->runs) {
      const ReproductionRun* run = &reproduction.runs.at(name);
      if (std::ranges::find(runs, run) == runs.end()) runs.push_back(run);
    }
  }
  return runs;
}

std::optional<double> measured_s(const Reproduction& reproduction, const ReproductionEntry& entry,
                                 ReproductionSize size) {
  double sum_s = 0;
  for (const std::string& name : entry.runs) {
    const std::optional<double> run_s = reproduction.runs.at(name).at(size).measured_s;
    if (!run_s) return std::nullopt;
    sum_s += *run_s;
  }
  return sum_s;
}

}  // namespace pilesim
