#include "json/schema_page.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "json/codec.h"

namespace pilesim {
namespace {

// Removes the variables and random values that may replace any value: the page describes them once.
Json without_stand_in(const Json& schema) {
  const auto either = schema.find("anyOf");
  return either != schema.end() && either->size() == 2 && (*either)[1].contains("$ref")
             ? without_stand_in((*either)[0])
             : schema;
}

std::string escaped_cell(std::string text) {
  for (const char* special : {"|", "*"}) {
    for (size_t at = text.find(special); at != text.npos; at = text.find(special, at + 2)) {
      text.insert(at, "\\");
    }
  }
  return text;
}

// Prints numbers as people write them: "5", not "5.0".
std::string short_text(const Json& value) {
  if (value.is_number_float()) return number_text(value.get<double>());
  if (!value.is_array()) return value.dump();
  std::string text;
  for (const Json& part : value) text += (text.empty() ? "" : ", ") + short_text(part);
  return '[' + text + ']';
}

std::string code(const Json& value) { return '`' + short_text(value) + '`'; }

std::string joined(const Json& values) {
  std::string text;
  for (size_t i = 0; i < values.size(); ++i) {
    text += (i == 0 ? "" : i + 1 == values.size() ? " or " : ", ") + code(values[i]);
  }
  return text;
}

std::string range_text(const Json& schema) {
  const auto limit = [&](const char* key) {
    const auto found = schema.find(key);
    const double value = found == schema.end() ? kLargestNumber : found->get<double>();
    // This limit only keeps numbers finite: leave it out.
    if (std::abs(value) >= kLargestNumber) return std::string();
    const auto whole = static_cast<int64_t>(value);
    return static_cast<double>(whole) == value ? std::to_string(whole) : number_text(value);
  };
  const std::string least = limit("minimum"), above = limit("exclusiveMinimum");
  const std::string most = limit("maximum"), below = limit("exclusiveMaximum");
  if (!least.empty() && !most.empty()) return " from " + least + " to " + most;
  std::string text;
  if (!least.empty()) text += ", at least " + least;
  if (!above.empty()) text += " above " + above;
  if (!most.empty()) text += ", at most " + most;
  if (!below.empty()) text += ", below " + below;
  return text;
}

class Page {
 public:
  explicit Page(std::string name) : top_(std::move(name)) {}

  std::string make(const Json& schema) {
    add(top_, without_stand_in(schema));
    write_sections();
    return text_;
  }

 private:
  // Writes pending sections, each followed by those of the objects in it.
  void write_sections() {
    const auto sections = std::exchange(waiting_, {});
    for (const auto& [path, object] : sections) {
      write_section(path, object);
      write_sections();
    }
  }

  // Adds a section for an object that has none yet, and returns its name.
  std::string add(const std::string& path, const Json& object) {
    const auto [found, is_new] = names_.try_emplace(object.dump(), path);
    if (is_new) waiting_.emplace_back(path, object);
    return found->second;
  }

  // The type of a value in words. `path` is the value's; objects in it get sections of their own.
  std::string value_text(const std::string& path, const Json& with_stand_in, bool several = false) {
    const Json schema = without_stand_in(with_stand_in);
    const std::string plural = several ? "s" : "";
    if (schema.contains("const")) return code(schema["const"]);
    if (schema.contains("enum")) return joined(schema["enum"]);
    if (schema.contains("oneOf") && !is_of_objects(schema["oneOf"])) {
      std::string text;
      for (const Json& one : schema["oneOf"]) {
        text += (text.empty() ? "" : ", or ") + value_text(path, one, several);
      }
      return text;
    }
    const std::string type = schema.value("type", std::string("object"));
    if (type == "string") {
      return schema.contains("pattern") ? "`\"#rrggbb\"`" : several ? "texts" : "text";
    }
    if (type == "boolean") return "`true` or `false`";
    if (type == "number" || type == "integer") return type + plural + range_text(schema);
    if (type == "array") return array_text(path, schema);
    if (schema.contains("additionalProperties") && schema["additionalProperties"].is_object()) {
      return "object: name to " + value_text(path + "/NAME", schema["additionalProperties"]);
    }
    if (!schema.contains("properties") && !schema.contains("oneOf")) return "object";
    const std::string name = add(path, schema);
    return "[" + name + "](#" + anchor(name) + ")";
  }

  std::string array_text(const std::string& path, const Json& schema) {
    const Json least = schema.value("minItems", Json(0)), most = schema.value("maxItems", Json());
    const std::string items = value_text(path + "/N", schema["items"], true);
    return least == most ? least.dump() + ' ' + items : "array of " + items;
  }

  static bool is_of_objects(const Json& alternatives) {
    return std::ranges::all_of(
        alternatives, [](const Json& one) { return without_stand_in(one).contains("properties"); });
  }

  // Objects have their defaults in their own sections, key by key.
  static std::string default_text(const Json& property) {
    const auto value = property.find("default");
    const bool is_told = value == property.end() || (value->is_object() && !value->empty()) ||
                         (value->is_array() && !value->empty() && value->front().is_object());
    return is_told ? "" : code(*value);
  }

  // Anchors in the style of GitHub.
  static std::string anchor(const std::string& heading) {
    std::string text;
    for (const char c : heading) {
      if (c != '/') text += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
    return text;
  }

  void write_section(const std::string& path, const Json& object) {
    text_ += "\n## " + path + "\n";
    if (const auto about = object.find("description"); about != object.end()) {
      text_ += "\n" + about->get<std::string>() + "\n";
    }
    if (!object.contains("oneOf")) return write_table(path, object, object["properties"]);
    // Keys common to all kinds come first, then those of each kind.
    std::vector<Json> kinds;
    for (const Json& kind : object["oneOf"]) kinds.push_back(without_stand_in(kind));
    Json common = Json::object();
    for (const auto& entry : kinds[0]["properties"].items()) {
      if (std::ranges::all_of(kinds, [&](const Json& kind) {
            return kind["properties"].value(entry.key(), Json()) == entry.value();
          })) {
        common[entry.key()] = entry.value();
      }
    }
    if (!common.empty()) write_table(path, kinds[0], common);
    for (const Json& kind : kinds) {
      Json own = Json::object();
      for (const auto& [key, property] : kind["properties"].items()) {
        if (!common.contains(key) && key != "type") own[key] = property;
      }
      text_ += "\n";
      if (const auto type = kind["properties"].find("type"); type != kind["properties"].end()) {
        text_ += "**`\"type\": " + (*type)["const"].dump() + "`** ";
      } else {
        text_ += kind == kinds.front() ? "**Either** " : "**Or** ";
      }
      text_ += kind.value("description", std::string()) + "\n";
      if (!own.empty()) write_table(path, kind, own);
    }
  }

  void write_table(const std::string& path, const Json& object, const Json& properties) {
    const Json required = object.value("required", Json::array());
    text_ += "\n| Key | Value | Default | Meaning |\n|---|---|---|---|\n";
    for (const auto& [key, property] : properties.items()) {
      const bool is_required = std::ranges::find(required, Json(key)) != required.end();
      const std::string name = '`' + key + '`';
      text_ += "| " + (is_required ? "**" + name + "**" : name) + " | " +
               value_text(path == top_ ? key : path + '/' + key, property) + " | " +
               default_text(property) + " | " +
               escaped_cell(property.value("description", std::string())) + " |\n";
    }
  }

  std::string top_, text_;
  std::vector<std::pair<std::string, Json>> waiting_;
  std::map<std::string, std::string> names_;  // by the object's schema
};

}  // namespace

std::string schema_page(const Json& schema, const std::string& name) {
  return Page(name).make(schema);
}

}  // namespace pilesim
