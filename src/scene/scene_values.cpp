#include "scene/scene_values.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "core/philox.h"
#include "json/codec.h"

namespace pilesim {
namespace {

constexpr const char* kVariables = "variables";

// Beside the bodies of emitters, whose highest bit is 0, in their stream.
constexpr uint64_t kPlaces = uint64_t{1} << 63;

// FNV-1a: an object of its own for the random numbers of each place.
uint64_t hash_of(const std::string& pointer) {
  uint64_t hash = 0xcbf29ce484222325u;
  for (const char c : pointer) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
  return hash;
}

uint64_t seed_of(const Json& document) {
  const auto seed = document.find("seed");
  return seed != document.end() && seed->is_number_unsigned() ? seed->get<uint64_t>() : 1;
}

// Bytes that `json` takes in memory, roughly: the values themselves, keys and strings.
size_t bytes_of(const Json& json) {
  constexpr size_t kValue = 64;
  size_t bytes = kValue;
  if (json.is_string()) return bytes + json.get_ref<const std::string&>().size();
  if (json.is_object()) {
    for (const auto& [key, member] : json.items()) bytes += key.size() + bytes_of(member);
  } else if (json.is_array()) {
    for (const Json& member : json) bytes += bytes_of(member);
  }
  return bytes;
}

std::vector<std::string> keys_of(const Json& object) {
  std::vector<std::string> keys;
  for (const auto& [key, value] : object.items()) keys.push_back(key);
  return keys;
}

class Resolver {
 public:
  Resolver(Json& document, ProblemLog& log)
      : document_(document), log_(log), seed_(seed_of(document)) {}

  std::map<std::string, std::string> run() {
    const Path root;
    if (const auto found = document_.find(kVariables); found != document_.end()) {
      const Path place = root / kVariables;
      if (found->is_object()) {
        for (auto& [name, value] : found->items()) resolve(value, place / name);
        variables_ = std::move(*found);
      } else {
        log_.report(place, describe_value(*found), "an object of names and values");
      }
      document_.erase(kVariables);
    }
    are_known_ = true;
    // Other draws depend on it.
    if (const auto seed = document_.find("seed"); seed != document_.end()) {
      const Path place = root / "seed";
      if (seed->is_object() && seed->contains("random")) {
        log_.report(place, "is a random value", "a number: all draws come from the seed",
                    "Give another with --seed");
        *seed = 1;
      }
      resolve(*seed, place);
      seed_ = seed_of(document_);
    }
    for (auto& [key, value] : document_.items()) {
      const Path place = root / key;
      // Their keys are names.
      const bool is_named = key == "materials" || key == "shapes";
      is_named&& value.is_object() ? resolve_within(value, place) : resolve(value, place);
    }
    return std::move(used_);
  }

 private:
  void resolve_within(Json& value, const Path& path) {
    if (value.is_object()) {
      for (auto& [key, member] : value.items()) resolve(member, path / key);
    } else if (value.is_array()) {
      for (size_t i = 0; i < value.size(); ++i) resolve(value[i], path / i);
    }
  }

  void resolve(Json& value, const Path& path) {
    const bool stands_in = value.is_object() && (value.contains("var") || value.contains("random"));
    if (!stands_in) return resolve_within(value, path);
    if (value.size() > 1) {
      log_.report(path, describe_value(value), R"({"var": NAME} or {"random": ...} alone)");
    } else if (value.contains("var")) {
      put_variable(value, path);
    } else {
      draw(value, path);
    }
  }

  void put_variable(Json& value, const Path& path) {
    const Json name = value["var"];
    const Path place = path / "var";
    if (!are_known_) {
      log_.report(place, describe_value(name), "a variable that names no other one");
      return;
    }
    if (!name.is_string()) {
      log_.report(place, describe_value(name), "the name of a variable");
      return;
    }
    const auto found = variables_.find(name.get<std::string>());
    if (found == variables_.end()) {
      const std::vector<std::string> names = keys_of(variables_);
      log_.report(
          place, describe_value(name) + ", which is no variable of the scene",
          names.empty() ? "a name from /variables, which is empty" : "one of " + quoted_list(names),
          did_you_mean(name.get<std::string>(), names));
      return;
    }
    put_ += bytes_of(*found);
    if (put_ > kMostVariableBytes) {
      if (!is_too_much_) {
        log_.report(
            path, "is where variables have become too much",
            "at most " + std::to_string(kMostVariableBytes >> 20) + " MiB of values in their place",
            "Write shorter values, or use them less often");
      }
      is_too_much_ = true;
      return;
    }
    used_.emplace(path.pointer(), found.key());
    value = Json(*found);
  }

  // Nothing and a report where `json` is no number.
  std::optional<double> number_at(const Json& object, const char* key, const Path& path) {
    const auto found = object.find(key);
    if (found == object.end()) {
      log_.report(path, "lacks the key \"" + std::string(key) + '"',
                  R"({"from": A, "to": B} or {"of": [...]})");
      return std::nullopt;
    }
    const bool is_sound = found->is_number() && std::abs(found->get<double>()) <= kLargestNumber;
    if (is_sound) return found->get<double>();
    log_.report(path / key, describe_value(*found), kAnyNumber.phrase("a number"));
    return std::nullopt;
  }

  bool has_only(const Json& object, std::vector<std::string> keys, const Path& path) {
    for (const auto& [key, value] : object.items()) {
      if (std::ranges::find(keys, key) != keys.end()) continue;
      log_.report_key(path / key, "is no key of these values", "one of " + quoted_list(keys),
                      did_you_mean(key, keys));
      return false;
    }
    return true;
  }

  void draw(Json& value, const Path& path) {
    Json& how = value["random"];
    const Path place = path / "random";
    if (!how.is_object()) {
      log_.report(place, describe_value(how), R"({"from": A, "to": B} or {"of": [...]})");
      return;
    }
    if (are_known_) resolve_within(how, place);
    if (!log_.is_sound(place)) return;
    std::optional<Json> drawn =
        how.contains("of") ? draw_one(how, place) : draw_between(how, place);
    if (drawn) value = std::move(*drawn);
  }

  Philox dice(const Path& path) const {
    return {seed_, Stream::emitter, kPlaces | hash_of(path.pointer())};
  }

  std::optional<Json> draw_between(const Json& how, const Path& path) {
    const std::optional<double> from = number_at(how, "from", path),
                                to = number_at(how, "to", path);
    if (!from || !to || !has_only(how, {"from", "to", "integer"}, path)) return std::nullopt;
    const Json integer = how.value("integer", Json(false));
    if (!integer.is_boolean()) {
      log_.report(path / "integer", describe_value(integer), "true or false");
      return std::nullopt;
    }
    if (*to < *from) {
      log_.report(path / "to", "is " + number_text(*to), "at least " + number_text(*from));
      return std::nullopt;
    }
    if (!integer.get<bool>()) return Json(dice(path).uniform(*from, *to));
    const double least = std::ceil(*from), most = std::floor(*to);
    if (most < least) {
      log_.report(path, "has no integer in it", "a range with an integer");
      return std::nullopt;
    }
    const double drawn = least + std::floor((most - least + 1) * dice(path).uniform());
    return Json(static_cast<int64_t>(std::min(drawn, most)));
  }

  std::optional<Json> draw_one(const Json& how, const Path& path) {
    if (!has_only(how, {"of", "weights"}, path)) return std::nullopt;
    const Json& of = how["of"];
    if (!of.is_array() || of.empty()) {
      log_.report(path / "of", describe_value(of), "an array with at least one value");
      return std::nullopt;
    }
    std::vector<double> weights(of.size(), 1);
    if (how.contains("weights")) {
      const Json& given = how["weights"];
      const auto is_weight = [](const Json& weight) {
        return weight.is_number() && weight.get<double>() >= 0 &&
               weight.get<double>() <= kLargestNumber;
      };
      if (!given.is_array() || given.size() != of.size() ||
          !std::ranges::all_of(given, is_weight)) {
        log_.report(
            path / "weights", describe_value(given),
            "a number of at least 0 for each of the " + std::to_string(of.size()) + " values");
        return std::nullopt;
      }
      for (size_t i = 0; i < weights.size(); ++i) weights[i] = given[i].get<double>();
    }
    double sum = 0;
    for (const double weight : weights) sum += weight;
    if (sum == 0) {
      log_.report(path / "weights", "are all 0", "at least one above 0");
      return std::nullopt;
    }
    double left = sum * dice(path).uniform();
    size_t chosen = weights.size();
    for (size_t i = 0; i < weights.size() && left >= 0; ++i) {
      if (weights[i] == 0) continue;
      chosen = i;
      left -= weights[i];
    }
    return of[chosen];
  }

  Json& document_;
  ProblemLog& log_;
  uint64_t seed_;
  Json variables_ = Json::object();
  size_t put_ = 0;  // bytes that came from variables
  bool is_too_much_ = false;
  bool are_known_ = false;  // else they are being resolved themselves
  std::map<std::string, std::string> used_;
};

}  // namespace

std::map<std::string, std::string> resolve_values(Json& document, ProblemLog& log) {
  if (!document.is_object()) return {};
  return Resolver(document, log).run();
}

Json stand_in_schema() {
  const Json number = {{"type", "number"}};
  const Json between = {
      {"type", "object"},
      {"properties", {{"from", number}, {"to", number}, {"integer", {{"type", "boolean"}}}}},
      {"required", {"from", "to"}},
      {"additionalProperties", false}};
  const Json one = {{"type", "object"},
                    {"properties",
                     {{"of", {{"type", "array"}, {"minItems", 1}}},
                      {"weights", {{"type", "array"}, {"items", number}}}}},
                    {"required", {"of"}},
                    {"additionalProperties", false}};
  const auto alone = [](const char* key, const Json& value) {
    return Json{{"type", "object"},
                {"properties", {{key, value}}},
                {"required", Json::array({key})},
                {"additionalProperties", false}};
  };
  return {{"description", "A variable of the scene, or a value drawn by its seed."},
          {"oneOf", Json::array({alone("var", {{"type", "string"}}),
                                 alone("random", {{"oneOf", Json::array({between, one})}})})}};
}

Json with_stand_ins(Json schema) {
  if (!schema.is_object()) return schema;
  const auto wrap = [](Json inner) {
    return Json{{"anyOf", Json::array({with_stand_ins(std::move(inner)),
                                       Json{{"$ref", "#/$defs/stand_in"}}})}};
  };
  for (const char* key : {"oneOf", "anyOf"}) {
    if (!schema.contains(key)) continue;
    for (Json& each : schema[key]) each = with_stand_ins(std::move(each));
  }
  if (schema.contains("items")) schema["items"] = wrap(std::move(schema["items"]));
  if (schema.contains("additionalProperties") && schema["additionalProperties"].is_object()) {
    schema["additionalProperties"] = wrap(std::move(schema["additionalProperties"]));
  }
  if (schema.contains("properties")) {
    for (auto& [name, property] : schema["properties"].items()) {
      // The key that chooses the kind is written out: no variable may replace it.
      if (property.contains("const")) continue;
      Json wrapped = wrap(property);
      for (const char* key : {"description", "default"}) {
        if (property.contains(key)) wrapped[key] = property[key];
      }
      property = std::move(wrapped);
    }
  }
  return schema;
}

}  // namespace pilesim
