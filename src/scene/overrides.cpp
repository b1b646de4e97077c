#include "scene/overrides.h"

#include <algorithm>
#include <array>
#include <set>
#include <utility>
#include <vector>

#include "core/counted.h"
#include "core/printable.h"
#include "json/codec.h"

namespace pilesim {
namespace {

// Values that others of the light start from.
constexpr const char* kLightName = "/render/light/name";
constexpr const char* kSkyFile = "/render/light/sky_file";

constexpr size_t kLongestPlace = 80;  // bytes: a value may be a whole scene

Error refusal(std::string place, std::string found, std::string expected, std::string remedy = "") {
  return {ErrorKind::input, Problem{.file = std::move(place),
                                    .found = std::move(found),
                                    .expected = std::move(expected),
                                    .remedy = std::move(remedy)}};
}

Error too_deep() {
  return refusal("--set", "is nested too deeply",
                 "at most " + std::to_string(kMaxJsonDepth) + " levels");
}

// The keys and indices of a JSON pointer, from the root on.
std::vector<std::string> pointer_tokens(const std::string& pointer) {
  if (std::ranges::count(pointer, '/') > kMaxJsonDepth) throw too_deep();
  std::vector<std::string> tokens;
  try {
    for (Json::json_pointer rest(pointer); !rest.empty(); rest.pop_back()) {
      tokens.insert(tokens.begin(), rest.back());
    }
  } catch (const Json::exception&) {
    throw refusal("--set", "is \"" + pointer + '"', "a JSON pointer with ~0 for ~ and ~1 for /");
  }
  return tokens;
}

Json& entry_of(Json& array, const std::string& token, const std::string& reached,
               const Override& change) {
  const size_t size = array.size();
  const bool is_index =
      !token.empty() && token.size() < 10 && token.find_first_not_of("0123456789") == token.npos;
  const size_t index = is_index ? std::stoul(token) : size;
  if (index < size) return array[index];
  if (size == 0) throw refusal(change.place(), reached + " is empty", "an array with that entry");
  throw refusal(change.place(), reached + " has " + counted(size, "entry", "entries"),
                size == 1 ? "the index 0" : "an index from 0 to " + std::to_string(size - 1));
}

// Objects of the scene whose names the author chooses.
struct NamedKind {
  const char* key;
  const char* noun;
};
constexpr std::array kNamedKinds = {NamedKind{"materials", "material"},
                                    NamedKind{"shapes", "shape"},
                                    NamedKind{"variables", "variable"}};

// Adds the names after each {"var": NAME} in `json`.
void add_variables_used(const Json& json, std::set<std::string>& names) {
  if (!json.is_structured()) return;
  for (const auto& [key, value] : json.items()) {
    if (json.is_object() && key == "var" && value.is_string()) names.insert(value);
    add_variables_used(value, names);
  }
}

bool has_text(const Json& json, const std::string& text) {
  if (json.is_string()) return json == text;
  return json.is_structured() &&
         std::ranges::any_of(json, [&](const Json& each) { return has_text(each, text); });
}

}  // namespace

std::string Override::place() const { return "--set " + shortened(text, kLongestPlace); }

Override parse_override(const std::string& text) {
  const size_t equals = text.find('=');
  if (equals == text.npos || !text.starts_with('/')) {
    throw refusal("--set", "is \"" + text + '"', "/json/pointer=value",
                  "Write for example /simulator/sleeping=false");
  }
  const std::string given = text.substr(equals + 1);
  const auto check_depth = [](int depth, Json::parse_event_t, const Json&) {
    if (depth > kMaxJsonDepth) throw too_deep();
    return true;
  };
  Json value = Json::parse(given, check_depth, false);
  if (value.is_discarded()) value = given;
  return {text, text.substr(0, equals), std::move(value)};
}

void apply_override(const Override& change, Json& document) {
  Json* place = &document;
  std::string reached;
  for (const std::string& token : pointer_tokens(change.pointer)) {
    if (place->is_null()) *place = Json::object();
    if (place->is_object()) {
      place = &(*place)[token];
    } else if (place->is_array()) {
      place = &entry_of(*place, token, reached, change);
    } else {
      throw refusal(change.place(), reached + ' ' + describe_value(*place),
                    "an object or an array there");
    }
    reached += '/' + escape_pointer_token(token);
  }
  *place = change.value;
  if (change.pointer == kLightName) {
    document["render"]["light"] = {{"name", change.value}};
  } else if (change.pointer == kSkyFile) {
    document["render"]["light"].erase("sun");
  }
}

bool stands_for_others(const std::string& text) {
  return text.starts_with(std::string(kLightName) + '=') ||
         text.starts_with(std::string(kSkyFile) + '=');
}

void check_is_named(const Override& change, const Json& document, const Json& changed) {
  const std::vector<std::string> tokens = pointer_tokens(change.pointer);
  const auto kind = std::ranges::find_if(kNamedKinds, [&](const NamedKind& each) {
    return tokens.size() > 1 && tokens[0] == each.key;
  });
  if (kind == kNamedKinds.end()) return;
  std::set<std::string> names;
  const auto entries = document.find(kind->key);
  if (entries != document.end() && entries->is_object()) {
    for (const auto& [name, entry] : entries->items()) names.insert(name);
  }
  const std::string& name = tokens[1];
  const bool is_variable = kind->noun == std::string("variable");
  if (is_variable) {
    std::set<std::string> used;
    add_variables_used(changed, used);
    if (names.contains(name) && !used.contains(name)) {
      throw refusal(change.place(), "nothing in the scene uses the variable \"" + name + '"',
                    "a variable that a {\"var\": NAME} of the scene names");
    }
    names.merge(used);
  }
  if (names.contains(name) || (!is_variable && has_text(changed, name))) return;
  const std::vector<std::string> known(names.begin(), names.end());
  throw refusal(
      change.place(),
      "the scene has no " + std::string(kind->noun) + " \"" + name + "\", and nothing would use it",
      known.empty() ? "a name from /" + std::string(kind->key) + ", which is empty"
                    : "one of " + quoted_list(known),
      did_you_mean(name, known));
}

bool is_at_or_below(const std::string& pointer, const std::string& ancestor) {
  return pointer == ancestor || pointer.starts_with(ancestor + '/');
}

}  // namespace pilesim
