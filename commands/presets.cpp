// Scenes to start from, wherever pilesim is installed.
#include <algorithm>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/output_directory.h"
#include "installed.h"
#include "json/json_text.h"
#include "json/problem_log.h"
#include "options.h"
#include "print.h"
#include "scene/scene_files.h"

namespace pilesim {
namespace {

namespace fs = std::filesystem;

struct PresetArguments {
  std::string name, directory = ".";
  bool force = false;
};

// Name, "impulse/rabbits_in_a_crate", and file.
std::map<std::string, fs::path> find_presets(const fs::path& root) {
  std::map<std::string, fs::path> presets;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(root)) {
    if (entry.path().extension() != ".json") continue;
    presets.emplace(fs::relative(entry.path(), root).replace_extension().string(), entry.path());
  }
  return presets;
}

// Mode, length and title of a scene; title of a plan for `pilesim batch`.
std::string about(const fs::path& file) {
  const Json scene = read_json_file(file);
  if (scene.contains("steps")) return "a plan: " + scene.value("name", std::string());
  std::string mode = "impulse";
  if (const auto simulator = scene.find("simulator"); simulator != scene.end()) {
    mode = simulator->value("mode", mode);
  }
  return mode + ", " + scene.value("duration_s", Json()).dump() +
         " s: " + scene.value("name", std::string());
}

void list_presets() {
  const auto presets = find_presets(installed_directory("presets"));
  size_t width = 0;
  for (const auto& [name, file] : presets) width = std::max(width, name.size());
  for (const auto& [name, file] : presets) {
    print("%-*s  %s\n", static_cast<int>(width), name.c_str(), about(file).c_str());
  }
}

// A preset by its whole name, or by its last part where only one has that.
const std::pair<const std::string, fs::path>& chosen(const std::map<std::string, fs::path>& presets,
                                                     const std::string& name) {
  const std::pair<const std::string, fs::path>* found = nullptr;
  std::string others;
  for (const auto& preset : presets) {
    if (preset.first == name) return preset;
    if (fs::path(preset.first).filename() != name) continue;
    found = &preset;
    others += (others.empty() ? "" : " or ") + preset.first;
  }
  if (found != nullptr && others == found->first) return *found;
  const Problem several{
      .file = "preset \"" + name + '"', .found = "is the name of several", .expected = others};
  if (found != nullptr) throw Error(ErrorKind::usage, several);
  std::vector<std::string> names;
  for (const auto& preset : presets) {
    names.push_back(preset.first);
    names.push_back(fs::path(preset.first).filename());
  }
  throw Error(ErrorKind::usage, Problem{.file = several.file,
                                        .found = "is not there",
                                        .expected = "a name that pilesim presets lists",
                                        .remedy = did_you_mean(name, names)});
}

// Calls use(text) for every string in `json`.
void for_each_string(const Json& json, const std::function<void(const std::string&)>& use) {
  if (json.is_string()) use(json.get<std::string>());
  if (!json.is_structured()) return;
  for (const Json& part : json) for_each_string(part, use);
}

// Files that a scene names by a path beside it: as it names them, and where they are.
std::map<std::string, fs::path> files_of(const fs::path& preset) {
  std::map<std::string, fs::path> files;
  for_each_string(read_json_file(preset), [&](const std::string& text) {
    const fs::path named = text;
    if (!named.has_extension() || named.is_absolute()) return;
    const fs::path file = (preset.parent_path() / named).lexically_normal();
    if (fs::is_regular_file(file)) files.emplace(text, file);
    for (const std::string& part : files_named_by_mesh(file)) {
      files.emplace(part, file.parent_path() / part);
    }
  });
  return files;
}

// The preset and all files that it names, and that those name, as they are to be: side by side.
void gather(const fs::path& file, std::map<fs::path, std::string>& texts) {
  if (texts.contains(file)) return;
  std::string& text = texts[file] = read_file(file);
  if (file.extension() != ".json") return;
  for (const auto& [named, source] : files_of(file)) {
    gather(source, texts);
    const std::string before = Json(named).dump(), after = Json(source.filename().string()).dump();
    for (size_t at = text.find(before); at != std::string::npos;
         at = text.find(before, at + after.size())) {
      text.replace(at, before.size(), after);
    }
  }
}

void copy_preset(const PresetArguments& options) {
  const auto presets = find_presets(installed_directory("presets"));
  const auto& [name, file] = chosen(presets, options.name);
  const fs::path directory = options.directory;
  std::map<fs::path, std::string> texts;
  gather(file, texts);
  if (fs::exists(directory)) {
    for (const auto& [source, text] : texts) {
      claim_output_file(directory / source.filename(), options.force);
    }
  }
  make_output_directory(directory);
  for (const auto& [source, text] : texts) {
    write_file_atomically(directory / source.filename(), text);
    print("%s\n", (directory / source.filename()).c_str());
  }
}

}  // namespace

void add_presets_command(CLI::App& app) {
  auto options = std::make_shared<PresetArguments>();
  CLI::App* command = app.add_subcommand(
      "presets", "List the scenes that come with pilesim, or copy one to start from");
  CLI::App* copy = command->add_subcommand("copy", "Copy a preset with the files that it names");
  copy->add_option("name", options->name, "A name of the list: impulse/rabbits_in_a_crate")
      ->required()
      ->type_name("NAME");
  copy->add_option("directory", options->directory, "Directory of the copy (default: here)")
      ->type_name("DIRECTORY")
      ->check(named(), "");
  copy->add_flag("--force", options->force, "Replace files that exist");
  copy->callback([options] { copy_preset(*options); });
  command->footer(R"(
Examples:
  pilesim presets
  pilesim presets copy tower_of_boxes my_pile)");
  command->callback([command] {
    if (command->get_subcommands().empty()) list_presets();
  });
}

}  // namespace pilesim
