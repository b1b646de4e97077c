#include "scene/scene_loader.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <utility>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/hash.h"
#include "json/json_text.h"
#include "scene/overrides.h"
#include "scene/scene_checks.h"
#include "scene/scene_format.h"
#include "scene/scene_sources.h"
#include "scene/scene_values.h"

namespace pilesim {

namespace {

std::string to_text(const Json& json) {
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + '\n';
}

std::string parent_of(const std::string& pointer) {
  return pointer.empty() ? "" : pointer.substr(0, pointer.rfind('/'));
}

// Turns findings into problems with file, line and column, each in the file that it comes from.
class Locator {
 public:
  // `causes`: for each finding the override that it comes from, null where it is a file's.
  // `sources` and `variables` (by pointer) must outlive it.
  Locator(const SceneSources& sources, const std::map<std::string, std::string>& variables,
          const std::vector<Finding>& findings, const std::vector<const Override*>& causes)
      : sources_(sources), variables_(variables), offsets_(sources.files().size()) {
    for (const SceneSources::File& file : sources.files()) lines_.emplace_back(file.text);
    for (size_t i = 0; i < findings.size(); ++i) {
      if (causes[i] != nullptr) continue;
      const SceneSources::Place place = sources.place(findings[i].pointer);
      // With all ancestors: a missing value is shown where it should be.
      for (std::string pointer = place.pointer;; pointer = parent_of(pointer)) {
        offsets_[place.file][pointer];
        if (pointer.empty()) break;
      }
    }
    for (size_t i = 0; i < offsets_.size(); ++i) {
      if (offsets_[i].empty()) continue;
      walk_json(sources.files()[i].text, [&](const JsonPlace& place) {
        const auto wanted = offsets_[i].find(place.pointer);
        if (wanted != offsets_[i].end()) wanted->second = {place.key_offset, place.value_offset};
      });
    }
  }

  Problem locate(const Finding& finding, const Override* cause) const {
    Problem problem{.pointer = finding.pointer,
                    .found = finding.found + variable_of(finding.pointer),
                    .expected = finding.expected,
                    .remedy = finding.remedy};
    if (cause != nullptr) {
      problem.file = cause->place();
      if (finding.pointer == cause->pointer) problem.pointer.clear();
      return problem;
    }
    const SceneSources::Place place = sources_.place(finding.pointer);
    problem.file = sources_.files()[place.file].name;
    problem.pointer = place.pointer;
    const auto& offsets = offsets_[place.file];
    std::string pointer = place.pointer;
    while (!offsets.at(pointer)) pointer = parent_of(pointer);
    const auto [key, value] = *offsets.at(pointer);
    const TextPosition position = lines_[place.file].position(finding.at_key ? key : value);
    problem.line = position.line;
    problem.column = position.column;
    return problem;
  }

 private:
  // Whose value it is that was found there, if it is one's.
  std::string variable_of(std::string pointer) const {
    for (; !pointer.empty(); pointer = parent_of(pointer)) {
      const auto found = variables_.find(pointer);
      if (found != variables_.end()) return ", by the variable \"" + found->second + '"';
    }
    return "";
  }

  using Offsets = std::map<std::string, std::optional<std::pair<size_t, size_t>>>;

  const SceneSources& sources_;
  const std::map<std::string, std::string>& variables_;
  std::vector<LineIndex> lines_;  // by file
  std::vector<Offsets> offsets_;  // by file: of key and value, by pointer
};

// Greatest number of repeated keys of a file that are reported.
constexpr size_t kMostRepeated = 100'000;

std::vector<Problem> repeated_keys(const std::string& text, const std::string& file) {
  std::vector<Problem> problems;
  const LineIndex lines(text);
  walk_json(text, [&](const JsonPlace& place) {
    if (!place.repeats_key || problems.size() >= kMostRepeated) return;
    const TextPosition position = lines.position(place.key_offset);
    problems.push_back({.file = file,
                        .pointer = place.pointer,
                        .line = position.line,
                        .column = position.column,
                        .found = "is given twice",
                        .expected = "each key once in an object"});
  });
  return problems;
}

// The simple settings (no named or listed things) of `json` that differ from `defaults`.
void collect_changes(const Json& json, const Json& defaults, const std::string& pointer,
                     Json& changes) {
  if (!defaults.is_object()) {
    if (json != defaults) changes[pointer] = json;
    return;
  }
  for (const auto& [key, value] : defaults.items()) {
    const bool is_collection = value.is_structured() && value.empty();
    if (!is_collection) collect_changes(json.at(key), value, pointer + '/' + key, changes);
  }
}

enum class MeshFiles { must_exist, may_be_elsewhere };

struct Reading {
  Scene scene;
  ReadContext context;
  std::map<std::string, std::string> variables;  // by the pointers where they were put
};

Reading read_document(Json document, const std::filesystem::path& file, MeshFiles mesh_files) {
  Reading reading;
  reading.variables = resolve_values(document, reading.context.log);
  if (!reading.context.log.findings().empty()) return reading;  // the document is no scene yet
  reading.context.directory = std::filesystem::absolute(file).parent_path();
  scene_codec().read(document, Path(), reading.scene, reading.context);
  SimulatorSettings& simulator = reading.scene.simulator;
  const Json::json_pointer levels("/simulator/level_of_detail/levels");
  if (simulator.method == Method::dissertation && !document.contains(levels)) {
    simulator.detail.levels = LevelOfDetail::table_4_1();
  }
  check_scene(reading.scene, document, reading.context.log);
  if (mesh_files == MeshFiles::must_exist) check_mesh_files(reading.scene, reading.context.log);
  return reading;
}

// For each finding the override that it comes from: the last one that sets its place, else the last
// one without which it is not there. Null: it is the file's own.
std::vector<const Override*> find_causes(const Json& document, const std::filesystem::path& file,
                                         MeshFiles mesh_files,
                                         const std::vector<Override>& overrides,
                                         const std::vector<Finding>& findings) {
  std::vector<const Override*> causes(findings.size());
  Json changed = document;
  for (size_t i = 0; i < overrides.size(); ++i) {
    const Reading reading = read_document(changed, file, mesh_files);
    std::set<std::pair<std::string, std::string>> there;  // pointer, found value
    for (const Finding& finding : reading.context.log.findings()) {
      there.emplace(finding.pointer, finding.found);
    }
    for (size_t j = 0; j < findings.size(); ++j) {
      const Finding& finding = findings[j];
      if (is_at_or_below(finding.pointer, overrides[i].pointer)) causes[j] = &overrides[i];
      if (there.contains({finding.pointer, finding.found})) continue;
      if (causes[j] == nullptr || !is_at_or_below(finding.pointer, causes[j]->pointer)) {
        causes[j] = &overrides[i];
      }
    }
    apply_override(overrides[i], changed);
  }
  return causes;
}

LoadedScene read_scene(const std::string& text, const std::filesystem::path& file,
                       std::span<const std::string> overrides, MeshFiles mesh_files) {
  const SceneSources sources(text, file);
  const Json& document = sources.document();
  const bool is_plan =
      document.is_object() && document.contains("steps") && !document.contains("shapes");
  if (is_plan) {
    throw Error(ErrorKind::input, Problem{.file = file.string(),
                                          .found = "is a plan of many runs",
                                          .expected = "a scene",
                                          .remedy = "Run the plan with pilesim batch"});
  }
  std::vector<Problem> problems;
  for (const SceneSources::File& source : sources.files()) {
    const std::vector<Problem> repeated = repeated_keys(source.text, source.name);
    problems.insert(problems.end(), repeated.begin(), repeated.end());
  }

  const auto add_problems = [&](const Error& error) {
    problems.insert(problems.end(), error.problems().begin(), error.problems().end());
  };
  Json changed = document;
  std::vector<Override> changes;
  std::vector<std::string> ordered(overrides.begin(), overrides.end());
  std::ranges::stable_partition(ordered, stands_for_others);
  for (const std::string& argument : ordered) {
    try {
      const Override change = parse_override(argument);
      if (is_at_or_below(change.pointer, "/include")) {
        throw Error(ErrorKind::input, Problem{.file = change.place(),
                                              .found = "comes after all files are read",
                                              .expected = "a value of the scene that they make"});
      }
      apply_override(change, changed);
      changes.push_back(change);
    } catch (const Error& error) {
      add_problems(error);
    }
  }
  const auto is_misspelt = [&](const Override& change) {
    try {
      check_is_named(change, document, changed);
      return false;
    } catch (const Error& error) {
      add_problems(error);
      return true;
    }
  };
  if (std::erase_if(changes, is_misspelt) > 0) {
    changed = document;
    for (const Override& change : changes) apply_override(change, changed);
  }

  Reading reading = read_document(changed, file, mesh_files);
  const std::vector<Finding>& findings = reading.context.log.findings();
  if (!findings.empty()) {
    const auto causes = find_causes(document, file, mesh_files, changes, findings);
    const Locator locator(sources, reading.variables, findings, causes);
    for (size_t i = 0; i < findings.size(); ++i) {
      problems.push_back(locator.locate(findings[i], causes[i]));
    }
  }
  if (!problems.empty()) {
    std::stable_sort(problems.begin(), problems.end(), [](const Problem& a, const Problem& b) {
      return std::pair(a.line, a.column) < std::pair(b.line, b.column);
    });
    throw Error(ErrorKind::input, std::move(problems));
  }

  LoadedScene loaded{.scene = std::move(reading.scene), .files = std::move(reading.context.files)};
  std::stable_sort(loaded.scene.events.begin(), loaded.scene.events.end(),
                   [](const Event& a, const Event& b) { return a.time_s < b.time_s; });
  const Json resolved = scene_codec().write(loaded.scene);
  Json differences = Json::object();
  collect_changes(resolved, scene_codec().write(Scene{}), "", differences);
  loaded.resolved = to_text(resolved);
  Json portable = resolved;
  for (const NamedFile& named : loaded.files) {
    portable.at(Json::json_pointer(named.pointer)) = named.written;
  }
  loaded.portable = to_text(portable);
  loaded.changed_options = to_text(differences);
  return loaded;
}

// All of it, read once in a process.
const std::string& standard_input() {
  static const std::string text = [] {
    std::string all;
    std::array<char, 1 << 16> block;
    for (;;) {
      const ssize_t size = ::read(STDIN_FILENO, block.data(), block.size());
      if (size < 0 && errno == EINTR) continue;
      if (size < 0) throw io_error(kStandardInput, "read", errno);
      if (size == 0) return all;
      all.append(block.data(), static_cast<size_t>(size));
      if (all.size() > kMostJsonBytes) {
        throw Error(ErrorKind::input,
                    Problem{.file = kStandardInput,
                            .found = "is longer than " + std::to_string(kMostJsonBytes) + " bytes",
                            .expected = "a scene"});
      }
    }
  }();
  return text;
}

}  // namespace

LoadedScene parse_scene(const std::string& text, const std::filesystem::path& file,
                        std::span<const std::string> overrides) {
  return read_scene(text, file, overrides, MeshFiles::may_be_elsewhere);
}

LoadedScene load_scene(const std::filesystem::path& file, std::span<const std::string> overrides) {
  const std::string text =
      file == kStandardInput ? standard_input() : read_file(file, kMostJsonBytes);
  return read_scene(text, file, overrides, MeshFiles::must_exist);
}

std::string settings_text(const RenderSettings& settings) {
  std::string text = to_text(scene_codec().write(Scene{.render = settings}).at("render"));
  std::error_code missing;
  const auto& sky = settings.light.sky_file;
  if (sky && std::filesystem::exists(*sky, missing)) text += content_hash(read_file(*sky));
  return text;
}

std::string scene_schema() {
  Json schema = {{"$schema", "https://json-schema.org/draft/2020-12/schema"},
                 {"title", "pilesim scene"},
                 {"description",
                  "Metres, kilograms, seconds; y up, right-handed; angles in degrees where a key "
                  "ends in _deg. Comments are allowed."}};
  schema.update(with_stand_ins(scene_codec().schema));
  schema["$defs"]["stand_in"] = stand_in_schema();
  return schema.dump(2) + '\n';
}

}  // namespace pilesim
