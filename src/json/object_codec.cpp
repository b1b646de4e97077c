#include "json/object_codec.h"

#include <algorithm>
#include <map>

namespace pilesim {

Json described(Json schema, const std::string& description) {
  schema["description"] = description;
  return schema;
}

namespace object_codec {

size_t choose(const Json& json, const Path& path, const std::string& choice_key,
              const std::vector<std::string>& names, ProblemLog& log) {
  const std::string expected = "one of " + quoted_list(names);
  const auto choice = json.find(choice_key);
  if (choice == json.end()) {
    log.report(path, "has no \"" + choice_key + '"', expected);
    return names.size();
  }
  const std::string given = choice->is_string() ? choice->get<std::string>() : "";
  const auto found = std::find(names.begin(), names.end(), given);
  if (found == names.end()) {
    log.report(path / choice_key, describe_value(*choice), expected, did_you_mean(given, names));
  }
  return static_cast<size_t>(found - names.begin());
}

void report_unknown_keys(const Json& json, const Path& path, const std::string& noun,
                         const std::string& choice_key, const std::vector<const Key*>& keys,
                         ProblemLog& log) {
  std::vector<std::string> known;
  if (!choice_key.empty()) known.push_back(choice_key);
  for (const Key* key : keys) known.push_back(key->name);
  for (const auto& [name, value] : json.items()) {
    if (std::find(known.begin(), known.end(), name) != known.end()) continue;
    std::string found = "is no key of " + noun;
    if (!choice_key.empty()) found += " with " + choice_key + ' ' + json[choice_key].dump();
    log.report_key(path / name, found, "one of " + quoted_list(known), did_you_mean(name, known));
  }
}

void report_missing_keys(const Json& json, const Path& path, const std::vector<const Key*>& keys,
                         ProblemLog& log) {
  for (size_t i = 0; i < keys.size(); ++i) {
    const Key& key = *keys[i];
    std::string names = '"' + key.name + '"';
    const bool is_there = json.contains(key.name);
    bool stands = is_there;
    bool is_first = true;
    for (size_t j = 0; j < keys.size() && !key.group.empty(); ++j) {
      if (j == i || keys[j]->group != key.group) continue;
      is_first = is_first && i < j;
      names += " or \"" + keys[j]->name + '"';
      const bool other_stands = json.contains(keys[j]->name);
      if (i < j && is_there && other_stands) {
        log.report_key(path / keys[j]->name, "stands beside \"" + key.name + '"',
                       "one of the two, because both say the same");
      }
      stands = stands || other_stands;
    }
    if (key.is_required && !stands && is_first) {
      log.report(path, "has no " + names, key.expected);
    }
  }
}

Json object_schema(const std::vector<std::pair<const Key*, Json>>& keys) {
  Json properties = Json::object();
  Json required = Json::array();
  std::map<std::string, std::vector<const Key*>> groups;
  for (const auto& [key, schema] : keys) {
    properties[key->name] = schema;
    if (!key->group.empty()) {
      groups[key->group].push_back(key);
    } else if (key->is_required) {
      required.push_back(key->name);
    }
  }
  Json rules = Json::array();
  for (const auto& [group, members] : groups) {
    Json each = Json::array();
    Json all = Json::array();
    for (const Key* key : members) {
      each.push_back({{"required", Json::array({key->name})}});
      all.push_back(key->name);
    }
    rules.push_back(members.front()->is_required ? Json{{"oneOf", each}}
                                                 : Json{{"not", {{"required", all}}}});
  }
  Json schema = {{"type", "object"}, {"properties", std::move(properties)}};
  if (!required.empty()) schema["required"] = std::move(required);
  schema["additionalProperties"] = false;
  if (!rules.empty()) schema["allOf"] = std::move(rules);
  return schema;
}

Json alternative_schema(Json schema, const std::string& choice_key, const std::string& name,
                        const std::string& description) {
  Json properties = {{choice_key, {{"const", name}}}};
  properties.update(schema["properties"]);
  schema["properties"] = std::move(properties);
  Json required = Json::array({choice_key});
  for (const Json& key : schema.value("required", Json::array())) required.push_back(key);
  schema["required"] = std::move(required);
  schema["description"] = description;
  return schema;
}

}  // namespace object_codec

}  // namespace pilesim
