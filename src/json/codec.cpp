#include "json/codec.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "core/rotation.h"

namespace pilesim {

namespace {

// Every body of an emitter carries the name.
constexpr size_t kLongestName = 255;   // bytes
constexpr size_t kLongestPath = 4096;  // bytes; the system's limit

std::string has_bytes(size_t size) { return "has " + std::to_string(size) + " bytes"; }

// A vector or quaternion of unit length within rounding is not normalised, so that a resolved scene
// reads back to the same bits.
constexpr double kUnitByRounding = 1e-12;
constexpr double kUnitByIntent = 1e-3;

Json plain_schema(const std::string& type) { return {{"type", type}}; }

Json array_schema(Json element, size_t size) {
  return {{"type", "array"}, {"items", std::move(element)}, {"minItems", size}, {"maxItems", size}};
}

bool check_array(const Json& json, size_t size, const std::string& expected, const Path& path,
                 ReadContext& context) {
  if (json.is_array() && json.size() == size) return true;
  context.log.report(path, describe_value(json), expected);
  return false;
}

// The expectation reported with `found`. The general limit on numbers is named only if exceeded.
std::string expected_number(const Range& range, const Json& found) {
  const std::string phrase = range.phrase("a number");
  const bool is_unlimited = range.maximum == kLargestNumber && range.minimum != -kLargestNumber;
  const bool exceeds = found.is_number() && found.get<double>() > kLargestNumber;
  return is_unlimited && exceeds ? phrase + " and at most 1e9" : phrase;
}

// Reads all `values.size()` numbers, or reports each one that is not a number.
template <size_t N>
bool read_numbers(const Json& json, const Path& path, const std::string& expected, Range range,
                  std::array<double, N>& values, ReadContext& context) {
  if (!check_array(json, N, expected, path, context)) return false;
  bool is_sound = true;
  for (size_t i = 0; i < N; ++i) {
    if (!json[i].is_number() || !range.contains(json[i].get<double>())) {
      context.log.report(path / i, describe_value(json[i]), expected_number(range, json[i]));
      is_sound = false;
      continue;
    }
    values[i] = json[i].get<double>();
  }
  return is_sound;
}

Json write_vector(const Vec3& v) { return Json::array({v.x(), v.y(), v.z()}); }

// The shortest number of degrees that radians() converts back to exactly `angle`.
double exact_degrees(double angle) {
  const double nearest = degrees(angle);
  for (const int digits : {6, 15, 17}) {
    std::array<char, 40> buffer;
    const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), nearest,
                                   std::chars_format::general, digits);
    double rounded = 0;
    std::from_chars(buffer.data(), end.ptr, rounded);
    if (radians(rounded) == angle) return rounded;
  }
  const double below = std::nextafter(nearest, 0.0);
  return radians(below) == angle ? below : std::nextafter(nearest, 1e9);
}

bool is_integer(const Json& json) {
  if (json.is_number_integer()) return true;
  if (!json.is_number_float()) return false;
  const double value = json.get<double>();
  return value == std::floor(value);
}

}  // namespace

std::string number_text(double number) {
  std::array<char, 40> buffer;
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), number);
  return {buffer.data(), end.ptr};
}

std::string describe_value(const Json& json) {
  constexpr size_t kLongest = 60;
  switch (json.type()) {
    case Json::value_t::object:
      return "is an object";
    case Json::value_t::array:
      return json.empty() ? "is an empty array"
                          : "is an array of " + std::to_string(json.size()) +
                                (json.size() == 1 ? " value" : " values");
    case Json::value_t::number_float:
      return "is " + number_text(json.get<double>());
    default: {
      std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
      if (text.size() > kLongest) {
        size_t cut = kLongest - 4;
        while (cut > 0 && (static_cast<unsigned char>(text[cut]) >> 6) == 2) --cut;
        text = text.substr(0, cut) + "...\"";
      }
      return "is " + text;
    }
  }
}

std::string quoted_list(const std::vector<std::string>& words) {
  constexpr size_t kMost = 40;
  std::string text;
  const size_t shown = std::min(words.size(), kMost);
  for (size_t i = 0; i < shown; ++i) text += (i == 0 ? "\"" : ", \"") + words[i] + '"';
  if (words.size() > shown) text += " and " + std::to_string(words.size() - shown) + " more";
  return text;
}

bool Range::contains(double number) const {
  const bool above_minimum = excludes_minimum ? number > minimum : number >= minimum;
  const bool below_maximum = excludes_maximum ? number < maximum : number <= maximum;
  return above_minimum && below_maximum;
}

std::string Range::phrase(const std::string& noun) const {
  const std::string low = number_text(minimum);
  const std::string high = number_text(maximum);
  if (minimum == -kLargestNumber && maximum == kLargestNumber) {
    return noun + " from -1e9 to 1e9";
  }
  if (maximum == kLargestNumber) {
    return noun + (excludes_minimum ? " above " : " of at least ") + low;
  }
  if (!excludes_minimum && !excludes_maximum) return noun + " from " + low + " to " + high;
  return noun + (excludes_minimum ? " above " : " of at least ") + low +
         (excludes_maximum ? " and below " : " and at most ") + high;
}

void Range::add_to_schema(Json& schema) const {
  schema[excludes_minimum ? "exclusiveMinimum" : "minimum"] = minimum;
  schema[excludes_maximum ? "exclusiveMaximum" : "maximum"] = maximum;
}

Codec<double> number(Range range) {
  Codec<double> codec;
  codec.expected = range.phrase("a number");
  codec.schema = plain_schema("number");
  range.add_to_schema(codec.schema);
  codec.read = [range](const Json& json, const Path& path, double& value, ReadContext& context) {
    if (!json.is_number() || !range.contains(json.get<double>())) {
      context.log.report(path, describe_value(json), expected_number(range, json));
      return;
    }
    value = json.get<double>();
  };
  codec.write = [](const double& value) { return Json(value); };
  return codec;
}

Codec<double> angle_deg(Range range_deg) {
  Codec<double> codec = number(range_deg);
  codec.read = [in_degrees = codec.read](const Json& json, const Path& path, double& value,
                                         ReadContext& context) {
    double angle = degrees(value);
    in_degrees(json, path, angle, context);
    value = radians(angle);
  };
  codec.write = [](const double& value) { return Json(exact_degrees(value)); };
  return codec;
}

Codec<int> integer(int minimum, int maximum) {
  const Range range = between(minimum, maximum);
  Codec<int> codec;
  codec.expected = "an integer from " + std::to_string(minimum) + " to " + std::to_string(maximum);
  codec.schema = {{"type", "integer"}, {"minimum", minimum}, {"maximum", maximum}};
  codec.read = [range, expected = codec.expected](const Json& json, const Path& path, int& value,
                                                  ReadContext& context) {
    if (!is_integer(json) || !range.contains(json.get<double>())) {
      context.log.report(path, describe_value(json), expected);
      return;
    }
    value = static_cast<int>(json.get<double>());
  };
  codec.write = [](const int& value) { return Json(value); };
  return codec;
}

Codec<int> integer_choice(std::vector<int> choices) {
  Codec<int> codec;
  for (const int choice : choices) {
    codec.expected += (codec.expected.empty() ? "one of " : ", ") + std::to_string(choice);
  }
  codec.schema = {{"enum", choices}};
  codec.read = [choices, expected = codec.expected](const Json& json, const Path& path, int& value,
                                                    ReadContext& context) {
    for (const int choice : choices) {
      if (json.is_number() && json.get<double>() == choice) {
        value = choice;
        return;
      }
    }
    context.log.report(path, describe_value(json), expected);
  };
  codec.write = [](const int& value) { return Json(value); };
  return codec;
}

Codec<uint64_t> unsigned_integer() {
  Codec<uint64_t> codec;
  codec.expected = "an integer from 0 to 18446744073709551615";
  codec.schema = {{"type", "integer"}, {"minimum", 0}, {"maximum", UINT64_MAX}};
  codec.read = [expected = codec.expected](const Json& json, const Path& path, uint64_t& value,
                                           ReadContext& context) {
    // 1e3 is 1000 and -0 is 0; the parser keeps numbers without sign and exponent as unsigned.
    constexpr double kEndOfExact = 1ULL << 53U;
    const bool is_whole = json.is_number() && is_integer(json) &&
                          between(0, kEndOfExact).contains(json.get<double>());
    if (!json.is_number_unsigned() && !is_whole) {
      const bool is_too_coarse =
          json.is_number_float() && is_integer(json) && json.get<double>() > 0;
      context.log.report(path, describe_value(json), expected,
                         is_too_coarse ? "Write large ones with all their digits" : "");
      return;
    }
    value = json.get<uint64_t>();
  };
  codec.write = [](const uint64_t& value) { return Json(value); };
  return codec;
}

Codec<bool> boolean() {
  Codec<bool> codec;
  codec.expected = "true or false";
  codec.schema = plain_schema("boolean");
  codec.read = [](const Json& json, const Path& path, bool& value, ReadContext& context) {
    if (!json.is_boolean()) {
      context.log.report(path, describe_value(json), "true or false");
      return;
    }
    value = json.get<bool>();
  };
  codec.write = [](const bool& value) { return Json(value); };
  return codec;
}

Codec<std::string> text() {
  Codec<std::string> codec;
  codec.expected = "a string of 1 to " + std::to_string(kLongestName) + " bytes";
  codec.schema = {{"type", "string"}, {"minLength", 1}};
  codec.read = [expected = codec.expected](const Json& json, const Path& path, std::string& value,
                                           ReadContext& context) {
    const size_t size = json.is_string() ? json.get_ref<const std::string&>().size() : 0;
    if (size == 0 || size > kLongestName) {
      context.log.report(path, size == 0 ? describe_value(json) : has_bytes(size), expected);
      return;
    }
    value = json.get<std::string>();
  };
  codec.write = [](const std::string& value) { return Json(value); };
  return codec;
}

Codec<Vec3> vector3(Range range) {
  Codec<Vec3> codec;
  codec.expected = "an array of three numbers [x, y, z]";
  codec.schema = array_schema(number(range).schema, 3);
  codec.read = [range, expected = codec.expected](const Json& json, const Path& path, Vec3& value,
                                                  ReadContext& context) {
    std::array<double, 3> xyz{};
    if (read_numbers(json, path, expected, range, xyz, context)) value = {xyz[0], xyz[1], xyz[2]};
  };
  codec.write = write_vector;
  return codec;
}

Codec<Vec3> direction() {
  Codec<Vec3> codec;
  codec.expected = "a direction [x, y, z] other than [0, 0, 0]";
  codec.schema = array_schema(number().schema, 3);
  codec.read = [expected = codec.expected](const Json& json, const Path& path, Vec3& value,
                                           ReadContext& context) {
    std::array<double, 3> xyz{};
    if (!read_numbers(json, path, expected, kAnyNumber, xyz, context)) return;
    const Vec3 vector(xyz[0], xyz[1], xyz[2]);
    const double length = vector.stableNorm();
    if (length == 0) {
      context.log.report(path, "has no length", expected);
      return;
    }
    value = std::abs(length - 1) <= kUnitByRounding ? vector : Vec3(vector / length);
  };
  codec.write = write_vector;
  return codec;
}

Codec<Quat> quaternion() {
  Codec<Quat> codec;
  codec.expected = "a unit quaternion [w, x, y, z]";
  codec.schema = array_schema(number(between(-1 - kUnitByIntent, 1 + kUnitByIntent)).schema, 4);
  codec.read = [expected = codec.expected](const Json& json, const Path& path, Quat& value,
                                           ReadContext& context) {
    std::array<double, 4> wxyz{};
    if (!read_numbers(json, path, expected, kAnyNumber, wxyz, context)) return;
    const Quat quat(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
    const double length = quat.norm();
    if (std::abs(length - 1) > kUnitByIntent) {
      context.log.report(path, "has length " + number_text(length),
                         expected + " of length 1 within 0.001",
                         "Divide it by its length, or write \"rotation_deg\": [x, y, z]");
      return;
    }
    value = std::abs(length - 1) <= kUnitByRounding ? quat : quat.normalized();
  };
  codec.write = [](const Quat& quat) {
    return Json::array({quat.w(), quat.x(), quat.y(), quat.z()});
  };
  return codec;
}

Codec<Quat> rotation_deg() {
  Codec<Quat> codec;
  codec.expected = "an array of three angles in degrees [x, y, z]";
  codec.schema = array_schema(number().schema, 3);
  codec.read = [expected = codec.expected](const Json& json, const Path& path, Quat& value,
                                           ReadContext& context) {
    std::array<double, 3> angles{};
    if (!read_numbers(json, path, expected, kAnyNumber, angles, context)) return;
    value = from_rotation_deg({angles[0], angles[1], angles[2]});
  };
  codec.write = [](const Quat&) { return Json(); };
  return codec;
}

Codec<Colour> colour() {
  Codec<Colour> codec;
  codec.expected = "a colour \"#rrggbb\" in hexadecimal digits";
  codec.schema = {{"type", "string"}, {"pattern", "^#[0-9a-fA-F]{6}$"}};
  codec.read = [expected = codec.expected](const Json& json, const Path& path, Colour& value,
                                           ReadContext& context) {
    const std::string given = json.is_string() ? json.get<std::string>() : "";
    uint32_t rgb = 0;
    const char* const end = given.data() + given.size();
    const bool is_colour = given.size() == 7 && given[0] == '#' &&
                           std::from_chars(given.data() + 1, end, rgb, 16).ptr == end;
    if (!is_colour) {
      context.log.report(path, describe_value(json), expected);
      return;
    }
    value = {static_cast<uint8_t>(rgb >> 16), static_cast<uint8_t>(rgb >> 8),
             static_cast<uint8_t>(rgb)};
  };
  codec.write = [](const Colour& value) {
    constexpr std::string_view kDigits = "0123456789abcdef";
    std::string text = "#";
    for (const uint8_t channel : value) {
      text += kDigits[channel >> 4];
      text += kDigits[channel & 15];
    }
    return Json(text);
  };
  return codec;
}

Codec<std::filesystem::path> file_path() {
  Codec<std::filesystem::path> codec;
  codec.expected = "the path of a file";
  codec.schema = {{"type", "string"}, {"minLength", 1}};
  codec.read = [expected = codec.expected](const Json& json, const Path& path,
                                           std::filesystem::path& value, ReadContext& context) {
    const size_t size = json.is_string() ? json.get_ref<const std::string&>().size() : 0;
    if (size == 0 || size > kLongestPath) {
      context.log.report(path, size == 0 ? describe_value(json) : has_bytes(size), expected);
      return;
    }
    value = (context.directory / json.get<std::string>()).lexically_normal();
    context.files.push_back({path.pointer(), value, json.get<std::string>()});
  };
  codec.write = [](const std::filesystem::path& value) { return Json(value.string()); };
  return codec;
}

template <size_t N>
Codec<std::array<int, N>> integers(int minimum, int maximum, const std::string& meaning) {
  const Codec<int> element = integer(minimum, maximum);
  Codec<std::array<int, N>> codec;
  codec.expected = "an array of " + std::to_string(N) + " integers " + meaning;
  codec.schema = array_schema(element.schema, N);
  codec.read = [element, expected = codec.expected](const Json& json, const Path& path,
                                                    std::array<int, N>& values,
                                                    ReadContext& context) {
    if (!check_array(json, N, expected, path, context)) return;
    for (size_t i = 0; i < N; ++i) element.read(json[i], path / i, values[i], context);
  };
  codec.write = [](const std::array<int, N>& values) { return Json(values); };
  return codec;
}
template Codec<std::array<int, 2>> integers<2>(int, int, const std::string&);
template Codec<std::array<int, 3>> integers<3>(int, int, const std::string&);

}  // namespace pilesim
