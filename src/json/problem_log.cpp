#include "json/problem_log.h"

#include <algorithm>
#include <cctype>
#include <utility>

#include "json/json_text.h"

namespace pilesim {

namespace {

// Nobody reads more, and each may take kilobytes. Beyond this nothing is kept, and nothing counts
// as sound.
constexpr size_t kMostFindings = 65'536;

std::string lower_case(std::string_view word) {
  std::string lower(word);
  for (char& c : lower) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return lower;
}

// Distance from `word` to `name` in insertions, deletions, replacements and swaps of neighbours
// (optimal string alignment). A continuation of `name` ("_kg_m3") counts as one edit at most.
size_t misspelling(std::string_view word, std::string_view name) {
  std::vector<size_t> before_last(name.size() + 1), last(name.size() + 1), row(name.size() + 1);
  for (size_t j = 0; j <= name.size(); ++j) last[j] = j;
  for (size_t i = 1; i <= word.size(); ++i) {
    row[0] = i;
    for (size_t j = 1; j <= name.size(); ++j) {
      const size_t replaced = last[j - 1] + (word[i - 1] == name[j - 1] ? 0 : 1);
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, replaced});
      if (i > 1 && j > 1 && word[i - 1] == name[j - 2] && word[i - 2] == name[j - 1]) {
        row[j] = std::min(row[j], before_last[j - 2] + 1);
      }
    }
    std::swap(before_last, last);
    std::swap(last, row);
  }
  return std::min(last.back(), *std::min_element(last.begin(), last.end()) + 1);
}

}  // namespace

std::string Path::pointer() const {
  if (parent_ == nullptr) return {};
  const std::string token =
      key_.data() == nullptr ? std::to_string(index_) : escape_pointer_token(key_);
  return parent_->pointer() + '/' + token;
}

void ProblemLog::report(const Path& path, std::string found, std::string expected,
                        std::string remedy) {
  if (findings_.size() >= kMostFindings) return;
  findings_.push_back(
      {path.pointer(), false, std::move(found), std::move(expected), std::move(remedy)});
  pointers_.insert(findings_.back().pointer);
}

void ProblemLog::report_key(const Path& path, std::string found, std::string expected,
                            std::string remedy) {
  const size_t before = findings_.size();
  report(path, std::move(found), std::move(expected), std::move(remedy));
  if (findings_.size() > before) findings_.back().at_key = true;
}

bool ProblemLog::is_sound(const Path& path) const {
  if (findings_.empty()) return true;
  if (findings_.size() >= kMostFindings) return false;
  const std::string pointer = path.pointer();
  const std::string beginning = pointer + '/';
  const auto below = pointers_.lower_bound(beginning);
  return !pointers_.contains(pointer) &&
         (below == pointers_.end() || !below->starts_with(beginning));
}

bool ProblemLog::is_sound_itself(const Path& path) const {
  if (findings_.size() >= kMostFindings) return false;
  return findings_.empty() || !pointers_.contains(path.pointer());
}

namespace {

// A word of other tools, and ours.
constexpr std::pair<std::string_view, std::string_view> kOtherWords[] = {
    {"active", "dynamic"},
    {"animated", "kinematic"},
    {"ball", "sphere"},
    {"bounce", "material"},
    {"cube", "box"},
    {"density", "material"},
    {"dt", "step_s"},
    {"fixed", "static"},
    {"fps", "frame_rate"},
    {"friction", "material"},
    {"mass", "material"},
    {"mass_kg", "material"},
    {"model", "mesh"},
    {"movable", "dynamic"},
    {"orientation", "rotation_deg"},
    {"passive", "static"},
    {"path", "file"},
    {"restitution", "material"},
    {"rigid", "dynamic"},
    {"time", "duration_s"},
    {"timestep", "step_s"},
    {"translation", "position"},
};

}  // namespace

std::string did_you_mean(std::string_view word, std::span<const std::string> candidates) {
  constexpr size_t kLongestWord =
      100;  // longer words are no misspellings, and the search is quadratic
  if (word.size() < 2 || word.size() > kLongestWord) return {};
  const std::string wanted = lower_case(word);
  const std::string* nearest = nullptr;
  size_t nearest_distance = std::max<size_t>(1, wanted.size() / 3) + 1;
  for (const std::string& candidate : candidates) {
    const size_t distance = misspelling(wanted, lower_case(candidate));
    if (distance < nearest_distance) {
      nearest = &candidate;
      nearest_distance = distance;
    }
  }
  // "velocity" for "linear_velocity".
  if (nearest == nullptr && wanted.size() > 3) {
    const auto ends_so = std::ranges::find_if(candidates, [&](const std::string& candidate) {
      return lower_case(candidate).ends_with("_" + wanted);
    });
    if (ends_so != candidates.end()) nearest = &*ends_so;
  }
  for (const auto& [other, own] : kOtherWords) {
    if (nearest != nullptr || other != wanted) continue;
    const auto found = std::ranges::find(candidates, own);
    if (found != candidates.end()) nearest = &*found;
  }
  return nearest == nullptr ? "" : "Did you mean \"" + *nearest + "\"?";
}

}  // namespace pilesim
