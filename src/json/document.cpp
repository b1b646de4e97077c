#include "json/document.h"

#include <algorithm>
#include <map>
#include <optional>
#include <utility>

#include "core/error.h"
#include "json/json_text.h"

namespace pilesim {
namespace {

// Most repeated keys of a file that are reported.
constexpr size_t kMostRepeated = 100'000;

}  // namespace

void throw_findings(const ProblemLog& log, const std::string& text, const std::string& file) {
  const LineIndex lines(text);
  std::vector<std::pair<size_t, Problem>> problems;  // by offset
  const auto add = [&](size_t offset, Problem problem) {
    const TextPosition position = lines.position(offset);
    problem.file = file;
    problem.line = position.line;
    problem.column = position.column;
    problems.emplace_back(offset, std::move(problem));
  };
  // Positions of key and value for problems and the objects above them: those of a whole file would
  // take many times its size.
  std::map<std::string, std::optional<std::pair<size_t, size_t>>> places;
  for (const Finding& finding : log.findings()) {
    std::string pointer = finding.pointer;
    while (places.try_emplace(pointer).second && !pointer.empty()) {
      pointer.resize(pointer.rfind('/'));
    }
  }
  walk_json(text, [&](const JsonPlace& place) {
    const auto wanted = places.find(place.pointer);
    if (wanted != places.end()) wanted->second = {place.key_offset, place.value_offset};
    if (!place.repeats_key || problems.size() >= kMostRepeated) return;
    add(place.key_offset, {.pointer = place.pointer,
                           .found = "is given twice",
                           .expected = "each key once in an object"});
  });
  for (const Finding& finding : log.findings()) {
    // Report a missing key at the position of its object.
    std::string pointer = finding.pointer;
    while (!places.at(pointer)) pointer.resize(pointer.rfind('/'));
    const auto [key, value] = *places.at(pointer);
    add(finding.at_key ? key : value, {.pointer = finding.pointer,
                                       .found = finding.found,
                                       .expected = finding.expected,
                                       .remedy = finding.remedy});
  }
  if (problems.empty()) return;
  std::ranges::stable_sort(problems, {}, &std::pair<size_t, Problem>::first);
  std::vector<Problem> sorted;
  for (auto& [offset, problem] : problems) sorted.push_back(std::move(problem));
  throw Error(ErrorKind::input, std::move(sorted));
}

}  // namespace pilesim
