#include "scene/scene_loader.h"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "core/atomic_file.h"
#include "core/error.h"
#include "json/json_text.h"
#include "scene/scene_checks.h"
#include "scene/scene_format.h"

namespace pilesim {

namespace {

const std::string kOverride = "--set";  // stands for the file in messages about overrides

struct Override {
  std::string pointer;
  Json value;
};

bool is_at_or_below(const std::string& pointer, const std::string& ancestor) {
  return pointer == ancestor || pointer.starts_with(ancestor + '/');
}

std::string parent_of(const std::string& pointer) {
  return pointer.empty() ? "" : pointer.substr(0, pointer.rfind('/'));
}

Error override_error(const std::string& pointer, std::string found, std::string expected,
                     std::string remedy = "") {
  return {ErrorKind::input, Problem{.file = kOverride,
                                    .pointer = pointer,
                                    .found = std::move(found),
                                    .expected = std::move(expected),
                                    .remedy = std::move(remedy)}};
}

Override parse_override(const std::string& argument) {
  const size_t equals = argument.find('=');
  if (equals == argument.npos || !argument.starts_with('/')) {
    throw override_error("", "is \"" + argument + '"', "/json/pointer=value",
                         "Write for example /simulator/sleeping=false");
  }
  const std::string text = argument.substr(equals + 1);
  Json value;
  try {
    value = parse_json(text, kOverride);
  } catch (const Error&) {
    value = text;
  }
  return {argument.substr(0, equals), std::move(value)};
}

// The keys and indices of a JSON pointer, from the root on.
std::vector<std::string> pointer_tokens(const std::string& pointer) {
  std::vector<std::string> tokens;
  try {
    for (Json::json_pointer rest(pointer); !rest.empty(); rest.pop_back()) {
      tokens.insert(tokens.begin(), rest.back());
    }
  } catch (const Json::exception&) {
    throw override_error("", "is \"" + pointer + '"', "a JSON pointer with ~0 for ~ and ~1 for /");
  }
  return tokens;
}

// Sets the value. Objects on the way are made where missing; array entries must be there.
void apply(Json& document, Override& change) {
  Json* place = &document;
  std::string reached;
  for (const std::string& token : pointer_tokens(change.pointer)) {
    if (place->is_null()) *place = Json::object();
    if (place->is_object()) {
      place = &(*place)[token];
    } else if (place->is_array()) {
      const bool is_index = !token.empty() && token.size() < 10 &&
                            token.find_first_not_of("0123456789") == token.npos;
      const size_t index = is_index ? std::stoul(token) : place->size();
      if (index >= place->size()) {
        const std::string size = std::to_string(place->size());
        throw override_error(change.pointer, reached + " has " + size + " entries",
                             "an index below " + size);
      }
      place = &(*place)[index];
    } else {
      throw override_error(change.pointer, reached + ' ' + describe_value(*place),
                           "an object or an array there");
    }
    reached += '/' + escape_pointer_token(token);
  }
  *place = std::move(change.value);
}

// Turns findings into problems with file, line and column.
class Locator {
 public:
  Locator(const std::string& text, std::string file, const std::vector<Override>& overrides,
          const std::vector<Finding>& findings)
      : lines_(text), file_(std::move(file)), overrides_(overrides) {
    for (const Finding& finding : findings) {
      // With all ancestors: what is missing is shown where it should be.
      for (std::string pointer = finding.pointer;; pointer = parent_of(pointer)) {
        offsets_[pointer];
        if (pointer.empty()) break;
      }
    }
    walk_json(text, [&](const JsonPlace& place) {
      const auto wanted = offsets_.find(place.pointer);
      if (wanted != offsets_.end()) wanted->second = {place.key_offset, place.value_offset};
    });
  }

  Problem locate(const Finding& finding) const {
    Problem problem{.file = file_,
                    .pointer = finding.pointer,
                    .found = finding.found,
                    .expected = finding.expected,
                    .remedy = finding.remedy};
    for (const Override& change : overrides_) {
      if (is_at_or_below(finding.pointer, change.pointer) ||
          (is_at_or_below(change.pointer, finding.pointer) && !offsets_.at(finding.pointer))) {
        problem.file = kOverride;
        return problem;
      }
    }
    std::string pointer = finding.pointer;
    while (!offsets_.at(pointer)) pointer = parent_of(pointer);
    const auto [key, value] = *offsets_.at(pointer);
    const TextPosition position = lines_.position(finding.at_key ? key : value);
    problem.line = position.line;
    problem.column = position.column;
    return problem;
  }

 private:
  LineIndex lines_;
  std::string file_;
  const std::vector<Override>& overrides_;
  std::map<std::string, std::optional<std::pair<size_t, size_t>>> offsets_;  // of key and value
};

std::vector<Problem> repeated_keys(const std::string& text, const std::string& file) {
  std::vector<Problem> problems;
  const LineIndex lines(text);
  walk_json(text, [&](const JsonPlace& place) {
    if (!place.repeats_key) return;
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

LoadedScene read_scene(const std::string& text, const std::filesystem::path& file,
                       std::span<const std::string> overrides, MeshFiles mesh_files) {
  Json document = parse_json(text, file.string());
  std::vector<Problem> problems = repeated_keys(text, file.string());

  std::vector<Override> changes;
  for (const std::string& argument : overrides) {
    try {
      changes.push_back(parse_override(argument));
      apply(document, changes.back());
    } catch (const Error& error) {
      problems.insert(problems.end(), error.problems().begin(), error.problems().end());
    }
  }

  ReadContext context;
  context.directory = std::filesystem::absolute(file).parent_path();
  LoadedScene loaded;
  scene_codec().read(document, Path(), loaded.scene, context);
  check_scene(loaded.scene, document, context.log);
  if (mesh_files == MeshFiles::must_exist) check_mesh_files(loaded.scene, context.log);

  if (!context.log.findings().empty()) {
    const Locator locator(text, file.string(), changes, context.log.findings());
    for (const Finding& finding : context.log.findings())
      problems.push_back(locator.locate(finding));
  }
  if (!problems.empty()) {
    std::stable_sort(problems.begin(), problems.end(), [](const Problem& a, const Problem& b) {
      return std::pair(a.line, a.column) < std::pair(b.line, b.column);
    });
    throw Error(ErrorKind::input, std::move(problems));
  }

  std::stable_sort(loaded.scene.events.begin(), loaded.scene.events.end(),
                   [](const Event& a, const Event& b) { return a.time_s < b.time_s; });
  const Json resolved = scene_codec().write(loaded.scene);
  Json differences = Json::object();
  collect_changes(resolved, scene_codec().write(Scene{}), "", differences);
  const auto to_text = [](const Json& json) {
    return json.dump(2, ' ', false, Json::error_handler_t::replace) + '\n';
  };
  loaded.resolved = to_text(resolved);
  loaded.changed_options = to_text(differences);
  return loaded;
}

}  // namespace

LoadedScene parse_scene(const std::string& text, const std::filesystem::path& file,
                        std::span<const std::string> overrides) {
  return read_scene(text, file, overrides, MeshFiles::may_be_elsewhere);
}

LoadedScene load_scene(const std::filesystem::path& file, std::span<const std::string> overrides) {
  return read_scene(read_file(file, kMostJsonBytes), file, overrides, MeshFiles::must_exist);
}

std::string scene_schema() {
  Json schema = {{"$schema", "https://json-schema.org/draft/2020-12/schema"},
                 {"title", "pilesim scene"},
                 {"description",
                  "Metres, kilograms, seconds; y up, right-handed; angles in degrees where a key "
                  "ends in _deg. Comments are allowed."}};
  schema.update(scene_codec().schema);
  return schema.dump(2) + '\n';
}

}  // namespace pilesim
