#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "scene_test_support.h"

namespace pilesim {
namespace {

using nlohmann::json;

bool conforms(const json& value, const json& schema);

bool object_conforms(const json& value, const json& schema) {
  for (const json& key : schema.value("required", json::array())) {
    if (!value.contains(key.get<std::string>())) return false;
  }
  const json properties = schema.value("properties", json::object());
  for (const auto& [key, member] : value.items()) {
    if (properties.contains(key)) {
      if (!conforms(member, properties[key])) return false;
    } else if (schema.contains("additionalProperties")) {
      const json& others = schema["additionalProperties"];
      if (others.is_boolean() ? !others.get<bool>() : !conforms(member, others)) return false;
    }
  }
  return true;
}

bool type_conforms(const json& value, const std::string& type) {
  if (type == "object") return value.is_object();
  if (type == "array") return value.is_array();
  if (type == "string") return value.is_string();
  if (type == "boolean") return value.is_boolean();
  if (type == "integer") return value.is_number_integer();
  return type == "number" && value.is_number();
}

// The part of JSON Schema that the scene schema uses, implemented from the specification; an
// unknown keyword fails the test.
bool conforms(const json& value, const json& schema) {
  for (const auto& [keyword, rule] : schema.items()) {
    bool holds = true;
    if (keyword == "type") {
      holds = type_conforms(value, rule);
    } else if (keyword == "const") {
      holds = value == rule;
    } else if (keyword == "enum") {
      holds = std::find(rule.begin(), rule.end(), value) != rule.end();
    } else if (keyword == "oneOf") {
      holds = 1 == std::count_if(rule.begin(), rule.end(),
                                 [&](const json& each) { return conforms(value, each); });
    } else if (keyword == "anyOf") {
      holds = std::any_of(rule.begin(), rule.end(),
                          [&](const json& each) { return conforms(value, each); });
    } else if (keyword == "$ref") {
      static const json root = json::parse(scene_schema());
      holds = conforms(value, root.at(json::json_pointer(rule.get<std::string>().substr(1))));
    } else if (keyword == "allOf") {
      holds = std::all_of(rule.begin(), rule.end(),
                          [&](const json& each) { return conforms(value, each); });
    } else if (keyword == "not") {
      holds = !conforms(value, rule);
    } else if (keyword == "items") {
      holds = std::all_of(value.begin(), value.end(),
                          [&, &rule = rule](const json& each) { return conforms(each, rule); });
    } else if (keyword == "minimum") {
      holds = value >= rule;
    } else if (keyword == "maximum") {
      holds = value <= rule;
    } else if (keyword == "exclusiveMinimum") {
      holds = value > rule;
    } else if (keyword == "exclusiveMaximum") {
      holds = value < rule;
    } else if (keyword == "minItems") {
      holds = value.size() >= rule;
    } else if (keyword == "maxItems") {
      holds = value.size() <= rule;
    } else if (keyword == "minLength") {
      holds = !value.get<std::string>().empty();
    } else if (keyword == "required" || keyword == "properties" ||
               keyword == "additionalProperties") {
      holds = !value.is_object() || object_conforms(value, schema);
    } else if (keyword != "description" && keyword != "default" && keyword != "pattern" &&
               keyword != "$schema" && keyword != "title" && keyword != "$defs") {
      ADD_FAILURE() << "unknown keyword " << keyword;
    }
    if (!holds) return false;
  }
  return true;
}

TEST(SceneSchema, IsDraft2020AndDescribesEveryTopLevelKey) {
  const json schema = json::parse(scene_schema());
  EXPECT_EQ(schema["$schema"], "https://json-schema.org/draft/2020-12/schema");
  for (const auto& [key, property] : schema["properties"].items()) {
    EXPECT_TRUE(property.contains("description")) << key;
  }
  EXPECT_EQ(schema["properties"]["step_s"]["default"], "auto");
  EXPECT_EQ(schema["required"], json::array({"version"}));
}

TEST(SceneSchema, AcceptsWhatTheLoaderAccepts) {
  const json schema = json::parse(scene_schema());
  EXPECT_TRUE(conforms(json::parse(kFullScene, nullptr, true, true), schema));
  EXPECT_TRUE(conforms(json::parse(parse(kFullScene).resolved), schema));
}

TEST(SceneSchema, TakesVariablesAndDrawsInPlaceOfValues) {
  const json schema = json::parse(scene_schema());
  const std::string text = R"({"version": 1, "include": "other.json", "variables": {"n": 3},
    "duration_s": {"var": "n"}, "gravity": [0, {"random": {"from": -9, "to": -1}}, 0],
    "materials": {"m": {"friction": {"random": {"of": [0, 1], "weights": [1, 2]}}}}})";
  EXPECT_TRUE(conforms(json::parse(text), schema));
  EXPECT_FALSE(conforms(json::parse(replaced(text, "\"var\"", "\"vra\"")), schema));
  EXPECT_FALSE(conforms(json::parse(replaced(text, "\"from\"", "\"form\"")), schema));
}

TEST(SceneSchema, RefusesWhatTheLoaderRefuses) {
  const json schema = json::parse(scene_schema());
  const std::vector<std::pair<std::string, std::string>> mistakes = {
      {"\"duration_s\": 2.5", "\"duration_s\": 0"},
      {"\"restitution\"", "\"restitutio\""},
      {"\"version\": 1", "\"version\": 2"},
      {"\"size\": [0.2, 0.1, 0.4]", "\"size\": [0.2, 0.1]"},
      {"\"type\": \"plane\"", "\"type\": \"plain\""},
      {"\"radius\": 1.5, ", ""},
      {"\"orientation\": [1, 0, 0, 0]",
       "\"orientation\": [1, 0, 0, 0], \"rotation_deg\": [0, 0, 0]"},
      {"\"shape\": \"brick\", \"material\"", "\"material\""},
      {"\"samples\": 8", "\"samples\": 3"}};
  for (const auto& [from, to] : mistakes) {
    const std::string text = replaced(kFullScene, from, to);
    EXPECT_FALSE(problems_of(text).empty()) << to;
    EXPECT_FALSE(conforms(json::parse(text, nullptr, true, true), schema)) << to;
  }
}

}  // namespace
}  // namespace pilesim
