#include "geometry/mesh_bounds.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cstring>

namespace pilesim {
namespace {

constexpr std::string_view kGaps = " \t\r";

std::string too_many_faces() { return "has more than " + std::to_string(kMostFaces) + " faces"; }

// The end of the line at `at`, which a backslash before it continues on the next one.
size_t line_end(std::string_view text, size_t at) {
  for (size_t end = text.find('\n', at); end != text.npos; end = text.find('\n', end + 1)) {
    const size_t last = end > at && text[end - 1] == '\r' ? end - 1 : end;
    if (last == at || text[last - 1] != '\\') return end;
  }
  return text.size();
}

uint64_t words_of(std::string_view line) {
  uint64_t words = 0;
  bool is_within = false;
  for (const char c : line) {
    const bool is_blank = c == '\n' || c == '\\' || kGaps.find(c) != kGaps.npos;
    if (!is_blank && !is_within) ++words;
    is_within = !is_blank;
  }
  return words;
}

std::string fault_of_obj(std::string_view text) {
  FaceBudget budget;
  for (size_t at = 0; at < text.size();) {
    const size_t first = std::min(text.find_first_not_of(kGaps, at), text.size());
    const size_t end = line_end(text, first);
    const bool is_face =
        first + 1 < end && text[first] == 'f' && kGaps.find(text[first + 1]) != kGaps.npos;
    if (is_face) {
      std::string fault = budget.take(words_of(text.substr(first + 1, end - first - 1)));
      if (!fault.empty()) return fault;
    }
    at = end + 1;
  }
  return {};
}

// As readers tell: a binary file has as many bytes as its count of faces says. One of text has a
// word for each face and each corner.
std::string fault_of_stl(std::string_view bytes) {
  constexpr size_t kHead = 84, kFace = 50;
  if (bytes.size() > kHead + kFace * kMostFaces) return too_many_faces();
  if (!bytes.starts_with("solid")) return {};
  uint64_t facets = 0, corners = 0;
  const auto count = [&](std::string_view word, uint64_t& number) {
    const std::string_view blanks = " \t\r\n";
    for (size_t at = bytes.find(word); at != bytes.npos; at = bytes.find(word, at + word.size())) {
      if (at > 0 && blanks.find(bytes[at - 1]) != blanks.npos) ++number;
    }
  };
  count("facet", facets);
  count("vertex", corners);
  return std::max(facets, corners / 3) > kMostFaces ? too_many_faces() : std::string();
}

// By its head; fault_of_ply_head() has seen that it has one.
std::string fault_of_ply(std::string_view bytes) {
  constexpr std::string_view kElement = "element face";
  const std::string_view head = bytes.substr(0, bytes.find("end_header"));
  for (size_t at = head.find(kElement); at != head.npos; at = head.find(kElement, at)) {
    at = std::min(head.size(), head.find_first_not_of(kGaps, at + kElement.size()));
    uint64_t faces = 0;
    std::from_chars(head.data() + at, head.data() + head.size(), faces);
    if (faces > kMostFaces) return too_many_faces();
  }
  return {};
}

}  // namespace

std::string FaceBudget::take(uint64_t corners) {
  if (++faces_ > kMostFaces) return too_many_faces();
  constexpr uint64_t kMostCorners = 1 << 24;  // whose square is a number
  if (corners > 4) work_ += std::min(corners, kMostCorners) * std::min(corners, kMostCorners);
  if (work_ <= kMostPolygonWork) return {};
  return "has too large polygons, one of " + std::to_string(corners) +
         " corners: their squares may come to " + std::to_string(kMostPolygonWork) +
         "; cut them into triangles";
}

std::string fault_of_faces(const std::filesystem::path& file, std::string_view bytes) {
  std::string ending = file.extension().string();
  std::ranges::transform(ending, ending.begin(), [](unsigned char c) { return std::tolower(c); });
  if (ending == ".obj") return fault_of_obj(bytes);
  if (ending == ".stl") return fault_of_stl(bytes);
  if (ending == ".ply") return fault_of_ply(bytes);
  return {};
}

}  // namespace pilesim
