// Objects as lists of fields, with alternatives chosen by the value of one key ("type").
#pragma once

#include <algorithm>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "scene/codec.h"

namespace pilesim {

// One key of an object that becomes part of a T.
template <class T>
struct Field {
  std::string key;
  std::string expected;
  bool is_required = false;
  // Fields of one group set the same part of T: at most one may stand, and if they are required,
  // exactly one.
  std::string group;
  std::function<void(const Json&, const Path&, T&, ReadContext&)> read;
  std::function<std::optional<Json>(const T&)> write;  // none: the key is left out
  std::function<Json(const T& defaults)> schema;
};

template <class T>
using Fields = std::vector<Field<T>>;

// The part of a field that does not depend on how its member is reached.
template <class T, class M>
Field<T> documented(std::string key, const Codec<M>& codec, const std::string& description) {
  Json schema = codec.schema;
  schema["description"] = description;
  Field<T> field;
  field.key = std::move(key);
  field.expected = codec.expected;
  field.schema = [schema](const T&) { return schema; };
  return field;
}

// Not required; what stands there otherwise depends on the rest of the scene. `Access` takes a T&
// to an M& and a const T& to a const M&: a pointer to member or a generic lambda.
template <class T, class Access, class M>
Field<T> derived_field(std::string key, Access access, Codec<M> codec,
                       const std::string& description) {
  Field<T> field = documented<T>(std::move(key), codec, description);
  field.read = [access, codec](const Json& json, const Path& path, T& object,
                               ReadContext& context) {
    codec.read(json, path, std::invoke(access, object), context);
  };
  field.write = [access, codec](const T& object) {
    return std::optional<Json>(codec.write(std::invoke(access, object)));
  };
  return field;
}

template <class T, class Access, class M>
Field<T> required_field(std::string key, Access access, Codec<M> codec,
                        const std::string& description) {
  Field<T> field = derived_field<T>(std::move(key), access, std::move(codec), description);
  field.is_required = true;
  return field;
}

// Not required; the value of a T{} is the default.
template <class T, class Access, class M>
Field<T> field(std::string key, Access access, Codec<M> codec, const std::string& description) {
  Field<T> field = derived_field<T>(std::move(key), access, codec, description);
  field.schema = [access, codec, plain = field.schema](const T& defaults) {
    Json schema = plain(defaults);
    schema["default"] = codec.write(std::invoke(access, defaults));
    return schema;
  };
  return field;
}

// Not required; the member is a std::optional<M>.
template <class T, class Access, class M>
Field<T> optional_field(std::string key, Access access, Codec<M> codec,
                        const std::string& description) {
  Field<T> field = documented<T>(std::move(key), codec, description);
  field.read = [access, codec](const Json& json, const Path& path, T& object,
                               ReadContext& context) {
    codec.read(json, path, std::invoke(access, object).emplace(), context);
  };
  field.write = [access, codec](const T& object) {
    const std::optional<M>& member = std::invoke(access, object);
    return member ? std::optional<Json>(codec.write(*member)) : std::nullopt;
  };
  return field;
}

// Another way to write what a field of the same group writes; the resolved scene does not use it.
template <class T>
Field<T> input_only(Field<T> field) {
  field.write = [](const T&) { return std::optional<Json>(); };
  return field;
}

template <class T>
Field<T> in_group(std::string group, Field<T> field) {
  field.group = std::move(group);
  return field;
}

template <class T>
Fields<T> operator+(Fields<T> a, const Fields<T>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

// One value of the key that chooses, and the fields that come with it.
template <class T>
struct Alternative {
  std::string name;
  std::string description;
  std::function<void(T&)> select;
  std::function<bool(const T&)> is_selected;
  Fields<T> fields;
};

template <class T>
struct ObjectDescription {
  std::string noun;  // "a material"
  Fields<T> fields;
  std::string choice_key;  // empty: no alternatives
  std::vector<Alternative<T>> alternatives;
  // After all fields: what depends on several of them.
  std::function<void(const Json&, const Path&, T&, ReadContext&)> finish;
};

namespace object_codec {

// The fields that an object with the given alternative (or none) has.
template <class T>
std::vector<const Field<T>*> fields_of(const ObjectDescription<T>& description,
                                       const Alternative<T>* alternative) {
  std::vector<const Field<T>*> fields;
  for (const Field<T>& field : description.fields) fields.push_back(&field);
  if (alternative != nullptr) {
    for (const Field<T>& field : alternative->fields) fields.push_back(&field);
  }
  return fields;
}

// The alternative that `json` names, selected in `value`; null and a report if it names none.
template <class T>
const Alternative<T>* choose(const ObjectDescription<T>& description, const Json& json,
                             const Path& path, T& value, ReadContext& context) {
  std::vector<std::string> names;
  for (const Alternative<T>& alternative : description.alternatives) {
    names.push_back(alternative.name);
  }
  const std::string expected = "one of " + quoted_list(names);
  const auto choice = json.find(description.choice_key);
  if (choice == json.end()) {
    context.log.report(path, "has no \"" + description.choice_key + "\"", expected);
    return nullptr;
  }
  const std::string name = choice->is_string() ? choice->template get<std::string>() : "";
  for (const Alternative<T>& alternative : description.alternatives) {
    if (choice->is_string() && alternative.name == name) {
      alternative.select(value);
      return &alternative;
    }
  }
  context.log.report(path / description.choice_key, describe_value(*choice), expected,
                     did_you_mean(name, names));
  return nullptr;
}

template <class T>
void report_unknown_keys(const ObjectDescription<T>& description,
                         const std::vector<const Field<T>*>& fields, const Json& json,
                         const Path& path, ReadContext& context) {
  std::vector<std::string> known;
  if (!description.choice_key.empty()) known.push_back(description.choice_key);
  for (const Field<T>* field : fields) known.push_back(field->key);
  for (const auto& [key, value] : json.items()) {
    if (std::find(known.begin(), known.end(), key) != known.end()) continue;
    std::string found = "is no key of " + description.noun;
    if (!description.choice_key.empty()) {
      found += " with " + description.choice_key + ' ' + json[description.choice_key].dump();
    }
    context.log.report_key(path / key, found, "one of " + quoted_list(known),
                           did_you_mean(key, known));
  }
}

// Missing keys, and keys that exclude one another.
template <class T>
void report_groups(const std::vector<const Field<T>*>& fields, const Json& json, const Path& path,
                   ReadContext& context) {
  for (size_t i = 0; i < fields.size(); ++i) {
    const Field<T>& field = *fields[i];
    std::string names = '"' + field.key + '"';
    bool stands = json.contains(field.key);
    bool is_first = true;
    for (size_t j = 0; j < fields.size() && !field.group.empty(); ++j) {
      if (j == i || fields[j]->group != field.group) continue;
      is_first = is_first && i < j;
      names += " or \"" + fields[j]->key + '"';
      const bool other_stands = json.contains(fields[j]->key);
      if (i < j && stands && other_stands) {
        context.log.report_key(path / fields[j]->key, "stands beside \"" + field.key + '"',
                               "one of the two, because both say the same");
      }
      stands = stands || other_stands;
    }
    if (field.is_required && !stands && is_first) {
      context.log.report(path, "has no " + names, field.expected);
    }
  }
}

template <class T>
Json schema_of(const ObjectDescription<T>& description, const Alternative<T>* alternative) {
  T defaults{};
  Json schema = {{"type", "object"}};
  Json properties = Json::object();
  Json required = Json::array();
  std::map<std::string, std::vector<const Field<T>*>> groups;
  if (alternative != nullptr) {
    alternative->select(defaults);
    schema["description"] = alternative->description;
    properties[description.choice_key] = {{"const", alternative->name}};
    required.push_back(description.choice_key);
  }
  for (const Field<T>* field : fields_of(description, alternative)) {
    properties[field->key] = field->schema(defaults);
    if (!field->group.empty()) {
      groups[field->group].push_back(field);
    } else if (field->is_required) {
      required.push_back(field->key);
    }
  }
  schema["properties"] = std::move(properties);
  if (!required.empty()) schema["required"] = std::move(required);
  schema["additionalProperties"] = false;
  Json rules = Json::array();
  for (const auto& [group, fields] : groups) {
    Json each = Json::array();
    Json all = Json::array();
    for (const Field<T>* field : fields) {
      each.push_back({{"required", Json::array({field->key})}});
      all.push_back(field->key);
    }
    rules.push_back(fields.front()->is_required ? Json{{"oneOf", each}}
                                                : Json{{"not", {{"required", all}}}});
  }
  if (!rules.empty()) schema["allOf"] = std::move(rules);
  return schema;
}

}  // namespace object_codec

template <class T>
Codec<T> object(ObjectDescription<T> description) {
  using namespace object_codec;
  Codec<T> codec;
  codec.expected = "an object (" + description.noun + ")";
  if (description.choice_key.empty()) {
    codec.schema = schema_of<T>(description, nullptr);
  } else {
    Json alternatives = Json::array();
    for (const Alternative<T>& alternative : description.alternatives) {
      alternatives.push_back(schema_of(description, &alternative));
    }
    codec.schema = {{"oneOf", std::move(alternatives)}};
  }
  codec.read = [description, expected = codec.expected](const Json& json, const Path& path,
                                                        T& value, ReadContext& context) {
    if (!json.is_object()) {
      context.log.report(path, describe_value(json), expected);
      return;
    }
    const bool has_choice = !description.choice_key.empty();
    const Alternative<T>* alternative =
        has_choice ? choose(description, json, path, value, context) : nullptr;
    const std::vector<const Field<T>*> fields = fields_of(description, alternative);
    for (const Field<T>* field : fields) {
      const auto found = json.find(field->key);
      if (found != json.end()) field->read(*found, path / field->key, value, context);
    }
    report_groups(fields, json, path, context);
    // Which other keys may stand depends on the choice: without one, do not guess.
    if (has_choice && alternative == nullptr) return;
    report_unknown_keys(description, fields, json, path, context);
    if (description.finish) description.finish(json, path, value, context);
  };
  codec.write = [description](const T& value) {
    Json json = Json::object();
    const Alternative<T>* selected = nullptr;
    for (const Alternative<T>& alternative : description.alternatives) {
      if (alternative.is_selected(value)) selected = &alternative;
    }
    if (selected != nullptr) json[description.choice_key] = selected->name;
    for (const Field<T>* field : fields_of(description, selected)) {
      if (std::optional<Json> member = field->write(value)) json[field->key] = std::move(*member);
    }
    return json;
  };
  return codec;
}

}  // namespace pilesim
