#include "scene/overrides.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "core/counted.h"
#include "core/printable.h"
#include "json/codec.h"

namespace pilesim {
namespace {

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
}

bool is_at_or_below(const std::string& pointer, const std::string& ancestor) {
  return pointer == ancestor || pointer.starts_with(ancestor + '/');
}

}  // namespace pilesim
