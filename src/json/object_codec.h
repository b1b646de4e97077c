// Objects as lists of fields, with alternatives selected by one key ("type").
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "json/codec.h"

namespace pilesim {

// The description of one key of an object, independent of its type.
struct Key {
  std::string name;
  std::string expected;
  bool is_required = false;
  // Keys of one group set the same thing: at most one may be present, and exactly one if they are
  // required.
  std::string group;
};

// A key of an object that describes a part of T.
template <class T>
struct Field {
  Key key;
  std::function<void(const Json&, const Path&, T&, ReadContext&)> read;
  std::function<std::optional<Json>(const T&)> write;  // nullopt: leave the key out
  Json schema;
  std::function<Json(const T& defaults)> default_value;  // empty: no default
};

template <class T>
using Fields = std::vector<Field<T>>;

// Adds the description to `schema`.
Json described(Json schema, const std::string& description);

// Optional; without the key the value depends on the rest of the scene. `Access` maps T& to M& and
// const T& to const M&: a pointer to member or a generic lambda.
template <class T, class Access, class M>
Field<T> derived_field(std::string key, Access access, const Codec<M>& codec,
                       const std::string& description) {
  Field<T> field;
  field.key = {.name = std::move(key), .expected = codec.expected};
  field.schema = described(codec.schema, description);
  field.read = [access, read = codec.read](const Json& json, const Path& path, T& object,
                                           ReadContext& context) {
    read(json, path, std::invoke(access, object), context);
  };
  field.write = [access, write = codec.write](const T& object) {
    return std::optional<Json>(write(std::invoke(access, object)));
  };
  return field;
}

template <class T, class Access, class M>
Field<T> required_field(std::string key, Access access, const Codec<M>& codec,
                        const std::string& description) {
  Field<T> field = derived_field<T>(std::move(key), access, codec, description);
  field.key.is_required = true;
  return field;
}

// Optional; the default is the value in a T{}.
template <class T, class Access, class M>
Field<T> field(std::string key, Access access, const Codec<M>& codec,
               const std::string& description) {
  Field<T> field = derived_field<T>(std::move(key), access, codec, description);
  field.default_value = [access, write = codec.write](const T& defaults) {
    return write(std::invoke(access, defaults));
  };
  return field;
}

// Optional; the member is a std::optional<M>.
template <class T, class Access, class M>
Field<T> optional_field(std::string key, Access access, const Codec<M>& codec,
                        const std::string& description) {
  Field<T> field;
  field.key = {.name = std::move(key), .expected = codec.expected};
  field.schema = described(codec.schema, description);
  field.read = [access, read = codec.read](const Json& json, const Path& path, T& object,
                                           ReadContext& context) {
    read(json, path, std::invoke(access, object).emplace(), context);
  };
  field.write = [access, write = codec.write](const T& object) {
    const std::optional<M>& member = std::invoke(access, object);
    return member ? std::optional<Json>(write(*member)) : std::nullopt;
  };
  return field;
}

// Another way to write a field of the same group; the resolved scene does not use it.
template <class T>
Field<T> input_only(Field<T> field) {
  field.write = [](const T&) { return std::optional<Json>(); };
  return field;
}

// Left out of what is written where the test holds: for a key that scenes whose resolved text is
// hashed do not have.
template <class T, class Test>
Field<T> unless(Field<T> field, Test test) {
  field.write = [write = field.write, test](const T& object) {
    return test(object) ? std::nullopt : write(object);
  };
  return field;
}

template <class T>
Field<T> in_group(std::string group, Field<T> field) {
  field.key.group = std::move(group);
  return field;
}

template <class T>
Fields<T> operator+(Fields<T> a, const Fields<T>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

// One value of the selecting key, and the fields that belong to it.
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
  // Checks that involve several fields; called after all of them.
  std::function<void(const Json&, const Path&, T&, ReadContext&)> finish;
};

namespace object_codec {

// The part that is independent of T.

// The index in `names` of the value of `choice_key`; otherwise names.size(), and a report.
size_t choose(const Json& json, const Path& path, const std::string& choice_key,
              const std::vector<std::string>& names, ProblemLog& log);

// Reports unknown keys. `choice_key` may be empty.
void report_unknown_keys(const Json& json, const Path& path, const std::string& noun,
                         const std::string& choice_key, const std::vector<const Key*>& keys,
                         ProblemLog& log);

// Reports missing keys, and keys that exclude each other.
void report_missing_keys(const Json& json, const Path& path, const std::vector<const Key*>& keys,
                         ProblemLog& log);

// The schema of an object with these keys.
Json object_schema(const std::vector<std::pair<const Key*, Json>>& keys);
// The schema of one of its alternatives.
Json alternative_schema(Json schema, const std::string& choice_key, const std::string& name,
                        const std::string& description);

// The fields of an object with the given alternative (or none).
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

template <class T>
Json schema_of(const ObjectDescription<T>& description, const Alternative<T>* alternative) {
  T defaults{};
  if (alternative != nullptr) alternative->select(defaults);
  std::vector<std::pair<const Key*, Json>> keys;
  for (const Field<T>* field : fields_of(description, alternative)) {
    keys.emplace_back(&field->key, field->schema);
    if (field->default_value) keys.back().second["default"] = field->default_value(defaults);
  }
  return object_schema(keys);
}

template <class T>
Json schema_of(const ObjectDescription<T>& description) {
  if (description.choice_key.empty()) return schema_of<T>(description, nullptr);
  Json alternatives = Json::array();
  for (const Alternative<T>& alternative : description.alternatives) {
    alternatives.push_back(alternative_schema(schema_of(description, &alternative),
                                              description.choice_key, alternative.name,
                                              alternative.description));
  }
  return {{"oneOf", std::move(alternatives)}};
}

template <class T>
void read(const ObjectDescription<T>& description, const Json& json, const Path& path, T& value,
          ReadContext& context) {
  const Alternative<T>* alternative = nullptr;
  if (!description.choice_key.empty()) {
    std::vector<std::string> names;
    for (const Alternative<T>& each : description.alternatives) names.push_back(each.name);
    const size_t chosen = choose(json, path, description.choice_key, names, context.log);
    if (chosen < names.size()) {
      alternative = &description.alternatives[chosen];
      alternative->select(value);
    }
  }
  std::vector<const Key*> keys;
  for (const Field<T>* field : fields_of(description, alternative)) {
    keys.push_back(&field->key);
    const auto found = json.find(field->key.name);
    if (found != json.end()) field->read(*found, path / field->key.name, value, context);
  }
  report_missing_keys(json, path, keys, context.log);
  // The valid keys depend on the choice: without one, do not guess.
  if (!description.choice_key.empty() && alternative == nullptr) return;
  report_unknown_keys(json, path, description.noun, description.choice_key, keys, context.log);
  if (description.finish) description.finish(json, path, value, context);
}

template <class T>
Json write(const ObjectDescription<T>& description, const T& value) {
  Json json = Json::object();
  const Alternative<T>* selected = nullptr;
  for (const Alternative<T>& alternative : description.alternatives) {
    if (alternative.is_selected(value)) selected = &alternative;
  }
  if (selected != nullptr) json[description.choice_key] = selected->name;
  for (const Field<T>* field : fields_of(description, selected)) {
    if (std::optional<Json> member = field->write(value)) {
      json[field->key.name] = std::move(*member);
    }
  }
  return json;
}

}  // namespace object_codec

template <class T>
Codec<T> object(const ObjectDescription<T>& description) {
  Codec<T> codec;
  codec.expected = "an object (" + description.noun + ")";
  codec.schema = object_codec::schema_of(description);
  // Share the description: there are many fields, and users of a codec copy it.
  const auto shared = std::make_shared<const ObjectDescription<T>>(description);
  codec.read = [shared, expected = codec.expected](const Json& json, const Path& path, T& value,
                                                   ReadContext& context) {
    if (!json.is_object()) {
      context.log.report(path, describe_value(json), expected);
      return;
    }
    object_codec::read(*shared, json, path, value, context);
  };
  codec.write = [shared](const T& value) { return object_codec::write(*shared, value); };
  return codec;
}

}  // namespace pilesim
