#include "geometry/exact_coordinates.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <string_view>

namespace pilesim {
namespace {

// Greater ones are no longer all exact in single precision; half of it leaves room for neighbours.
constexpr double kLargestWhole = 1 << 23;

using Words = std::array<std::string_view, 3>;  // x, y, z as they stand in the file

constexpr std::string_view kBlank = " \t";

std::string_view next_word(std::string_view& line) {
  line.remove_prefix(std::min(line.size(), line.find_first_not_of(kBlank)));
  const std::string_view word = line.substr(0, line.find_first_of(kBlank));
  line.remove_prefix(word.size());
  return word;
}

std::string_view next_line(std::string_view& rest) {
  const size_t end = std::min(rest.size(), rest.find('\n'));
  std::string_view line = rest.substr(0, end);
  rest.remove_prefix(std::min(rest.size(), end + 1));
  if (line.ends_with('\r')) line.remove_suffix(1);
  return line;
}

Words three_words(std::string_view& line) {
  Words words;
  for (std::string_view& word : words) word = next_word(line);
  return words;
}

using Found = std::optional<std::vector<Words>>;

Found vertices_of_obj(std::string_view bytes) {
  std::vector<Words> found;
  while (!bytes.empty()) {
    std::string_view line = next_line(bytes);
    if (line.ends_with('\\')) return std::nullopt;  // goes on in the next one
    if (line.size() < 2 || line[0] != 'v' || kBlank.find(line[1]) == kBlank.npos) continue;
    line.remove_prefix(1);
    found.push_back(three_words(line));
    // A fourth number alone divides the others.
    if (!next_word(line).empty() && next_word(line).empty()) return std::nullopt;
  }
  return found;
}

Found vertices_of_stl(std::string_view bytes) {
  if (!bytes.starts_with("solid") || bytes.find("facet") == bytes.npos) return std::nullopt;
  std::vector<Words> found;
  while (!bytes.empty()) {
    std::string_view line = next_line(bytes);
    if (next_word(line) == "vertex") found.push_back(three_words(line));
  }
  return found;
}

Found vertices_of_ply(std::string_view bytes) {
  if (next_line(bytes) != "ply") return std::nullopt;
  uint64_t before = 0, vertices = 0;  // lines of other elements first
  std::array<size_t, 3> column{};     // of x, y and z, from 1 on
  size_t columns = 0;
  bool is_text = false, in_vertices = false, is_past = false;
  for (;;) {
    if (bytes.empty()) return std::nullopt;
    std::string_view line = next_line(bytes);
    const std::string_view key = next_word(line);
    if (key == "end_header") break;
    if (key == "format") is_text = next_word(line) == "ascii";
    if (key == "element") {
      is_past |= in_vertices;
      in_vertices = next_word(line) == "vertex";
      const std::string_view word = next_word(line);
      uint64_t count = 0;
      std::from_chars(word.data(), word.data() + word.size(), count);
      if (in_vertices) vertices = count;
      if (!in_vertices && !is_past) before += count;
    }
    if (key == "property" && in_vertices) {
      if (next_word(line) == "list") return std::nullopt;
      const std::string_view name = next_word(line);
      ++columns;
      for (size_t k = 0; k < 3; ++k) {
        if (name == std::string_view("xyz").substr(k, 1)) column[k] = columns;
      }
    }
  }
  if (!is_text || std::ranges::count(column, 0U) > 0) return std::nullopt;
  for (; before > 0 && !bytes.empty(); --before) next_line(bytes);
  std::vector<Words> found;
  for (; vertices > 0; --vertices) {
    if (bytes.empty()) return std::nullopt;
    std::string_view line = next_line(bytes);
    Words& words = found.emplace_back();
    for (size_t i = 1; i <= columns; ++i) {
      const std::string_view word = next_word(line);
      for (size_t k = 0; k < 3; ++k) {
        if (column[k] == i) words[k] = word;
      }
    }
  }
  return found;
}

Found vertices_of(const std::string& name, std::string_view bytes) {
  std::string ending = std::filesystem::path(name).extension().string();
  std::ranges::transform(ending, ending.begin(), [](unsigned char c) { return std::tolower(c); });
  if (ending == ".obj") return vertices_of_obj(bytes);
  if (ending == ".stl") return vertices_of_stl(bytes);
  if (ending == ".ply") return vertices_of_ply(bytes);
  return std::nullopt;
}

bool read_number(std::string_view word, double& value) {
  if (word.starts_with('+')) word.remove_prefix(1);
  const char* const end = word.data() + word.size();
  const auto parsed = std::from_chars(word.data(), end, value);
  return parsed.ec == std::errc() && parsed.ptr == end && std::isfinite(value);
}

}  // namespace

size_t ExactCoordinates::Hash::operator()(const Whole& whole) const {
  uint64_t hash = 0;
  for (const int32_t number : whole) {
    hash = (hash ^ static_cast<uint32_t>(number)) * 0x9E3779B97F4A7C15u;
    hash ^= hash >> 29;
  }
  return hash;
}

std::optional<ExactCoordinates> ExactCoordinates::of(const std::string& name,
                                                     const std::string& bytes) {
  const Found words = vertices_of(name, bytes);
  if (!words || words->empty()) return std::nullopt;
  std::vector<Vec3> vertices(words->size());
  Bounds bounds;
  for (size_t i = 0; i < vertices.size(); ++i) {
    for (size_t k = 0; k < 3; ++k) {
      if (!read_number((*words)[i][k], vertices[i][static_cast<int>(k)])) return std::nullopt;
    }
    bounds.extend(vertices[i]);
  }
  const double half = bounds.sizes().maxCoeff() / 2;
  if (!(half > 0) || !std::isfinite(half)) return std::nullopt;

  ExactCoordinates exact;
  exact.text_.reserve(bytes.size());
  const char* copied = bytes.data();
  exact.places_.reserve(vertices.size());
  for (size_t i = 0; i < vertices.size(); ++i) {
    const Vec3& vertex = vertices[i];
    const Vec3 scaled = (vertex - bounds.center()) * (kLargestWhole / half);
    Whole whole{};
    for (size_t k = 0; k < 3; ++k) {
      whole[k] = static_cast<int32_t>(std::lround(scaled[static_cast<int>(k)]));
    }
    // Another place may have these numbers.
    while (exact.places_.try_emplace(whole, vertex).first->second != vertex) ++whole[0];
    // In the order of the file.
    std::array<size_t, 3> order = {0, 1, 2};
    std::ranges::sort(order, {}, [&](size_t k) { return (*words)[i][k].data(); });
    for (const size_t k : order) {
      const std::string_view word = (*words)[i][k];
      exact.text_.append(copied, word.data());
      exact.text_ += std::to_string(whole[k]);
      copied = word.data() + word.size();
    }
  }
  exact.text_.append(copied, bytes.data() + bytes.size());
  return exact;
}

const Vec3* ExactCoordinates::find(float x, float y, float z) const {
  Whole whole{};
  const std::array<float, 3> read = {x, y, z};
  for (size_t k = 0; k < 3; ++k) {
    if (!(std::abs(read[k]) <= 2 * static_cast<float>(kLargestWhole))) return nullptr;
    whole[k] = static_cast<int32_t>(std::lround(read[k]));
  }
  const auto found = places_.find(whole);
  return found == places_.end() ? nullptr : &found->second;
}

}  // namespace pilesim
