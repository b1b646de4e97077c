#include "geometry/mesh_bounds.h"

#include <algorithm>
#include <cctype>
#include <cstring>

namespace pilesim {
namespace {

constexpr std::string_view kBlank = " \t\r";

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
    const bool is_blank = c == '\n' || c == '\\' || kBlank.find(c) != kBlank.npos;
    if (!is_blank && !is_within) ++words;
    is_within = !is_blank;
  }
  return words;
}

std::string fault_of_obj(std::string_view text) {
  FaceBudget budget;
  for (size_t at = 0; at < text.size();) {
    const size_t first = std::min(text.find_first_not_of(kBlank, at), text.size());
    const size_t end = line_end(text, first);
    const bool is_face =
        first + 1 < end && text[first] == 'f' && kBlank.find(text[first + 1]) != kBlank.npos;
    if (is_face) {
      const std::string fault = budget.take(words_of(text.substr(first + 1, end - first - 1)));
      if (!fault.empty()) return fault;
    }
    at = end + 1;
  }
  return {};
}

// Of a binary file; one of text takes more bytes for each.
std::string fault_of_stl(std::string_view bytes) {
  constexpr size_t kHead = 84, kFace = 50;
  return bytes.size() > kHead + kFace * kMostFaces ? too_many_faces() : std::string();
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
  return {};
}

}  // namespace pilesim
