// Arrays of numbers in CBOR documents: typed arrays (RFC 8746), little-endian, and their checks.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <type_traits>
#include <vector>

#include "core/error.h"

namespace pilesim {

static_assert(std::endian::native == std::endian::little, "typed arrays are written as they lie");

// Throws Error(input) for a document. A caller that knows the file's name adds it.
[[noreturn]] inline void damaged(const std::string& found, const std::string& expected) {
  throw Error(ErrorKind::input, {.found = found, .expected = expected});
}

// The tag of RFC 8746 for little-endian arrays of T.
template <typename T>
constexpr uint64_t array_tag() {
  if constexpr (std::is_same_v<T, float>) return 85;
  if constexpr (std::is_same_v<T, double>) return 86;
  if constexpr (std::is_same_v<T, int8_t>) return 72;
  if constexpr (std::is_same_v<T, uint32_t>) return 70;
  if constexpr (std::is_same_v<T, uint8_t>) return 64;
}

template <typename T>
nlohmann::json to_array(const std::vector<T>& values) {
  std::vector<uint8_t> bytes(values.size() * sizeof(T));
  if (!bytes.empty()) std::memcpy(bytes.data(), values.data(), bytes.size());
  return nlohmann::json::binary(std::move(bytes), array_tag<T>());
}

// The field `name`: `count` finite numbers.
template <typename T>
std::vector<T> from_array(const nlohmann::json& from, const char* name, size_t count) {
  const nlohmann::json& field = from.at(name);
  if (!field.is_binary() || !field.get_binary().has_subtype() ||
      field.get_binary().subtype() != array_tag<T>()) {
    damaged(std::string(name) + " is no array of the right type",
            "CBOR tag " + std::to_string(array_tag<T>()));
  }
  const nlohmann::json::binary_t& bytes = field.get_binary();
  if (bytes.size() % sizeof(T) != 0 || bytes.size() / sizeof(T) != count) {
    damaged(std::string(name) + " has " + std::to_string(bytes.size()) + " bytes",
            std::to_string(count) + " numbers of " + std::to_string(sizeof(T)));
  }
  std::vector<T> values(count);
  if (count > 0) std::memcpy(values.data(), bytes.data(), bytes.size());
  if constexpr (std::is_floating_point_v<T>) {
    if (!std::ranges::all_of(values, [](T value) { return std::isfinite(value); })) {
      damaged(std::string(name) + " contains a number that is not finite", "finite numbers");
    }
  }
  return values;
}

// The number `name`, which must lie in a range.
inline double number_of(const nlohmann::json& from, const char* name, double least, double most) {
  const nlohmann::json& field = from.at(name);
  const double value = field.is_number() ? field.get<double>() : NAN;
  if (!(value >= least && value <= most)) {
    damaged(std::string(name) + " is " + (field.is_number() ? field.dump() : "no number"),
            "a number from " + nlohmann::json(least).dump() + " to " + nlohmann::json(most).dump());
  }
  return value;
}

template <typename T>
T whole_number_of(const nlohmann::json& from, const char* name) {
  const nlohmann::json& field = from.at(name);
  if (!field.is_number_unsigned() || field.get<uint64_t>() > std::numeric_limits<T>::max()) {
    damaged(std::string(name) + " is not a whole number in its range",
            "at most " + std::to_string(std::numeric_limits<T>::max()));
  }
  return field.get<T>();
}

}  // namespace pilesim
