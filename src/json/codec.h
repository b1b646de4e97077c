// One description per kind of JSON value that reads, writes and documents it. Objects are described
// field by field: the reader's checks, the resolved scene and the JSON Schema all follow from that
// list.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/colour.h"
#include "core/types.h"
#include "json/json_text.h"
#include "json/named_file.h"
#include "json/problem_log.h"

namespace pilesim {

struct ReadContext {
  ProblemLog log;
  std::filesystem::path directory;  // absolute; relative paths start there
  std::vector<NamedFile> files;     // all files read, in order
};

template <class T>
struct Codec {
  std::string expected;  // "a number above 0": the expected kind of value, for messages
  // Reports errors to the log; wrong values leave `value` unchanged.
  std::function<void(const Json&, const Path&, T& value, ReadContext&)> read;
  std::function<Json(const T&)> write;
  Json schema;
};

// "is \"oak\"", "is an array of 2 values": the value found, cut to a readable length.
std::string describe_value(const Json& json);
std::string number_text(double number);
// "\"a\", \"b\"": quoted and joined by commas; after 40 words, the number of further ones.
std::string quoted_list(const std::vector<std::string>& words);

// Limit on a number's size; beyond it squares and cubes would overflow in the physics.
inline constexpr double kLargestNumber = 1e9;
struct Range {
  double minimum = -kLargestNumber;
  double maximum = kLargestNumber;
  bool excludes_minimum = false;
  bool excludes_maximum = false;

  bool contains(double number) const;
  // "a number from 0 to 1"; `noun` is "a number", "an integer".
  std::string phrase(const std::string& noun) const;
  void add_to_schema(Json& schema) const;
};
inline constexpr Range kAnyNumber{};
constexpr Range above(double minimum) { return {.minimum = minimum, .excludes_minimum = true}; }
constexpr Range at_least(double minimum) { return {.minimum = minimum}; }
constexpr Range between(double minimum, double maximum) { return {minimum, maximum}; }

Codec<double> number(Range range = kAnyNumber);
// Degrees in the file, radians in memory.
Codec<double> angle_deg(Range range_deg);
Codec<int> integer(int minimum, int maximum);
Codec<int> integer_choice(std::vector<int> choices);
Codec<uint64_t> unsigned_integer();
Codec<bool> boolean();
Codec<std::string> text();  // not empty
Codec<Vec3> vector3(Range range = kAnyNumber);
Codec<Vec3> direction();  // any non-zero length; normalised
Codec<Quat> quaternion();
Codec<Quat> rotation_deg();  // intrinsic x, y, z; reads only
Codec<Colour> colour();
Codec<std::filesystem::path> file_path();

template <size_t N>
Codec<std::array<int, N>> integers(int minimum, int maximum, const std::string& meaning);
extern template Codec<std::array<int, 2>> integers<2>(int, int, const std::string&);
extern template Codec<std::array<int, 3>> integers<3>(int, int, const std::string&);

// `words` pair each word in the file with its value.
template <class E>
Codec<E> enumeration(std::vector<std::pair<std::string, E>> words) {
  std::vector<std::string> names;
  for (const auto& [name, value] : words) names.push_back(name);
  Codec<E> codec;
  codec.expected = "one of " + quoted_list(names);
  codec.schema = {{"enum", names}};
  codec.read = [words, names, expected = codec.expected](const Json& json, const Path& path,
                                                         E& value, ReadContext& context) {
    const std::string given = json.is_string() ? json.get<std::string>() : "";
    for (const auto& [name, meaning] : words) {
      if (json.is_string() && name == given) {
        value = meaning;
        return;
      }
    }
    context.log.report(path, describe_value(json), expected, did_you_mean(given, names));
  };
  codec.write = [words](const E& value) {
    for (const auto& [name, meaning] : words) {
      if (meaning == value) return Json(name);
    }
    return Json();
  };
  return codec;
}

template <class T>
Codec<std::vector<T>> list(Codec<T> element, size_t minimum_size = 0) {
  Codec<std::vector<T>> codec;
  codec.expected = minimum_size == 0 ? "an array" : "an array with at least one entry";
  codec.schema = {{"type", "array"}, {"items", element.schema}};
  if (minimum_size > 0) codec.schema["minItems"] = minimum_size;
  codec.read = [element, minimum_size, expected = codec.expected](
                   const Json& json, const Path& path, std::vector<T>& values,
                   ReadContext& context) {
    if (!json.is_array() || json.size() < minimum_size) {
      context.log.report(path, describe_value(json), expected);
      return;
    }
    values.resize(json.size());
    for (size_t i = 0; i < json.size(); ++i) element.read(json[i], path / i, values[i], context);
  };
  codec.write = [element](const std::vector<T>& values) {
    Json json = Json::array();
    for (const T& value : values) json.push_back(element.write(value));
    return json;
  };
  return codec;
}

template <class T>
Codec<std::map<std::string, T>> named(Codec<T> element) {
  Codec<std::map<std::string, T>> codec;
  codec.expected = "an object";
  codec.schema = {{"type", "object"}, {"additionalProperties", element.schema}};
  codec.read = [element](const Json& json, const Path& path, std::map<std::string, T>& values,
                         ReadContext& context) {
    if (!json.is_object()) {
      context.log.report(path, describe_value(json), "an object");
      return;
    }
    for (const auto& [name, value] : json.items()) {
      element.read(value, path / name, values[name], context);
    }
  };
  codec.write = [element](const std::map<std::string, T>& values) {
    Json json = Json::object();
    for (const auto& [name, value] : values) json[name] = element.write(value);
    return json;
  };
  return codec;
}

}  // namespace pilesim
