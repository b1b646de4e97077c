#include "scene/scene_sources.h"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/atomic_file.h"
#include "json/codec.h"
#include "scene/scene_format.h"

namespace pilesim {
namespace {

namespace fs = std::filesystem;

constexpr std::array kLists = {"bodies", "emitters", "joints", "chains", "events", "piles"};
constexpr std::array kNamed = {"materials", "shapes", "variables"};

bool is_one_of(const auto& keys, const std::string& key) {
  return std::ranges::find(keys, key) != keys.end();
}

std::string below(const std::string& pointer, const std::string& token) {
  return pointer + '/' + escape_pointer_token(token);
}

// Makes the relative path at `key` of `object`, if there is one, start at another directory.
void move_path(Json& object, const char* key, const fs::path& directory) {
  if (!object.is_object()) return;
  const auto found = object.find(key);
  if (found == object.end() || !found->is_string()) return;
  const fs::path path = found->get<std::string>();
  const bool is_word = std::string_view(key) == "signature" && path == "auto";
  if (!path.empty() && !is_word && path.is_relative()) {
    *found = (directory / path).lexically_normal().generic_string();
  }
}

// All paths that a scene can hold.
void move_paths(Json& scene, const fs::path& directory) {
  if (!scene.is_object() || directory == ".") return;
  for (const auto& [key, value] : scene.items()) {
    if (key == "guide") move_path(value, "file", directory);
    if (key != "shapes" && key != "emitters") continue;
    if (!value.is_structured()) continue;
    for (Json& entry : value) {
      move_path(entry, "file", directory);
      move_path(entry, "signature", directory);
      move_path(entry, "font", directory);
    }
  }
}

}  // namespace

SceneSources::SceneSources(const std::string& text, const fs::path& file)
    : directory_(fs::absolute(file).parent_path()) {
  files_.push_back({file.string(), text});
  bytes_ = text.size();
  std::vector<fs::path> chain = {fs::absolute(file).lexically_normal()};
  Part part = read(text, file, chain);
  document_ = std::move(part.document);
  places_ = std::move(part.places);
}

// `file` is the last of files_.
SceneSources::Part SceneSources::read(const std::string& text, const fs::path& file,
                                      std::vector<fs::path>& chain) {
  const size_t index = files_.size() - 1;
  Part own{.document = parse_json(text, files_[index].name)};
  if (!own.document.is_object()) return own;
  Part whole{.document = Json::object()};
  if (const auto found = own.document.find("include"); found != own.document.end()) {
    const Json list = found->is_string() ? Json::array({*found}) : *found;
    if (!list.is_array()) {
      throw refusal(index, "/include", describe_value(list), "an array of scene files");
    }
    for (size_t i = 0; i < list.size(); ++i) {
      const std::string pointer =
          found->is_string() ? "/include" : below("/include", std::to_string(i));
      include(list[i], pointer, index, file, chain, whole);
    }
    own.document.erase("include");
  }
  if (index > 0) {
    const auto version = own.document.find("version");
    if (version == own.document.end() || *version != kSceneVersion) {
      throw refusal(
          index, version == own.document.end() ? "" : "/version",
          version == own.document.end() ? "lacks the key \"version\"" : describe_value(*version),
          std::to_string(kSceneVersion));
    }
    own.document.erase("version");
    own.document.erase("$schema");
    move_paths(own.document, fs::absolute(file).parent_path().lexically_proximate(directory_));
  }
  for (const auto& [key, value] : own.document.items()) {
    const std::string pointer = below("", key);
    own.places[pointer] = {index, pointer};
    if (value.is_array() && is_one_of(kLists, key)) {
      for (size_t i = 0; i < value.size(); ++i) {
        const std::string entry = below(pointer, std::to_string(i));
        own.places[entry] = {index, entry};
      }
    } else if (value.is_object() && is_one_of(kNamed, key)) {
      for (const auto& [name, entry] : value.items()) {
        own.places[below(pointer, name)] = {index, below(pointer, name)};
      }
    }
  }
  if (whole.document.empty()) return own;
  join(std::move(own), whole);
  return whole;
}

void SceneSources::include(const Json& written, const std::string& pointer, size_t includer,
                           const fs::path& file, std::vector<fs::path>& chain, Part& whole) {
  if (!written.is_string() || written.get<std::string>().empty()) {
    throw refusal(includer, pointer, describe_value(written), "the name of a scene file");
  }
  const fs::path path = file.parent_path() / written.get<std::string>();
  const fs::path full = fs::absolute(path).lexically_normal();
  const std::string found = "is \"" + full.string() + '"';
  if (std::ranges::find(chain, full) != chain.end()) {
    throw refusal(includer, pointer, found + ", which includes this file", "a file that does not");
  }
  if (chain.size() >= static_cast<size_t>(kDeepestInclude)) {
    throw refusal(includer, pointer,
                  "is included by " + std::to_string(chain.size()) + " files, one by another",
                  "at most " + std::to_string(kDeepestInclude) + " that include one another");
  }
  if (files_.size() > kMostIncluded) {
    throw refusal(includer, pointer, "is one file too many",
                  "at most " + std::to_string(kMostIncluded) + " included files");
  }
  std::error_code fault;
  if (!fs::is_regular_file(full, fault)) {
    throw refusal(
        includer, pointer,
        found + (fs::exists(full, fault) ? ", which is no file" : ", which does not exist"),
        "a scene file, relative to this one");
  }
  files_.push_back({path.string(), read_file(full, kMostJsonBytes)});
  bytes_ += files_.back().text.size();
  if (bytes_ > kMostJsonBytes) {
    throw refusal(includer, pointer,
                  found + ", with which all files are " + std::to_string(bytes_) + " bytes",
                  "at most " + std::to_string(kMostJsonBytes) + " bytes in all");
  }
  chain.push_back(full);
  Part part = read(std::string(files_.back().text), path, chain);
  chain.pop_back();
  if (!part.document.is_object()) {
    throw refusal(includer, pointer, found + ", which " + describe_value(part.document),
                  "a file with a scene");
  }
  join(std::move(part), whole);
}

void SceneSources::join(Part part, Part& whole) {
  const auto place = [&](const std::string& pointer) { return part.places.at(pointer); };
  for (auto& [key, value] : part.document.items()) {
    const std::string pointer = below("", key);
    whole.places[pointer] = place(pointer);
    const auto there = whole.document.find(key);
    if (value.is_array() && is_one_of(kLists, key) && there != whole.document.end() &&
        there->is_array()) {
      for (size_t i = 0; i < value.size(); ++i) {
        whole.places[below(pointer, std::to_string(there->size()))] =
            place(below(pointer, std::to_string(i)));
        there->push_back(std::move(value[i]));
      }
      continue;
    }
    const bool is_named = value.is_object() && is_one_of(kNamed, key);
    if (is_named && there != whole.document.end() && there->is_object()) {
      for (auto& [name, entry] : value.items()) {
        whole.places[below(pointer, name)] = place(below(pointer, name));
        (*there)[name] = std::move(entry);
      }
      continue;
    }
    whole.document[key] = std::move(value);
    // Places of the replaced value's entries are dropped.
    std::erase_if(whole.places,
                  [&](const auto& known) { return known.first.starts_with(pointer + '/'); });
    for (const auto& [entry, where] : part.places) {
      if (entry.starts_with(pointer + '/')) whole.places[entry] = where;
    }
  }
}

SceneSources::Place SceneSources::place(const std::string& pointer) const {
  for (std::string above = pointer; !above.empty(); above.resize(above.rfind('/'))) {
    const auto found = places_.find(above);
    if (found == places_.end()) continue;
    return {found->second.file, found->second.pointer + pointer.substr(above.size())};
  }
  return {0, pointer};
}

Error SceneSources::refusal(size_t file, const std::string& pointer, std::string found,
                            std::string expected, std::string remedy) const {
  Problem problem{.file = files_[file].name,
                  .pointer = pointer,
                  .found = std::move(found),
                  .expected = std::move(expected),
                  .remedy = std::move(remedy)};
  walk_json(files_[file].text, [&](const JsonPlace& place) {
    if (place.pointer != pointer) return;
    const TextPosition position = LineIndex(files_[file].text).position(place.value_offset);
    problem.line = position.line;
    problem.column = position.column;
  });
  return {ErrorKind::input, std::move(problem)};
}

}  // namespace pilesim
