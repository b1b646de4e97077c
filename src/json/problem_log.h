// Collects the problems of a JSON document by position while it is read.
#pragma once

#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace pilesim {

// A position in a document, as a chain on the stack: reading a valid file builds no strings. A path
// must not outlive its parent, so only named paths may have children.
class Path {
 public:
  Path() = default;
  Path operator/(std::string_view key) const& { return {this, key, 0}; }
  Path operator/(size_t index) const& { return {this, {}, index}; }
  Path operator/(std::string_view key) const&& = delete;
  Path operator/(size_t index) const&& = delete;
  // RFC 6901.
  std::string pointer() const;

 private:
  Path(const Path* parent, std::string_view key, size_t index)
      : parent_(parent), key_(key), index_(index) {}

  const Path* parent_ = nullptr;
  std::string_view key_;  // null data: an index
  size_t index_ = 0;
};

struct Finding {
  std::string pointer;
  bool at_key = false;  // refers to the key instead of the value
  std::string found, expected, remedy;
};

class ProblemLog {
 public:
  void report(const Path& path, std::string found, std::string expected, std::string remedy = "");
  void report_key(const Path& path, std::string found, std::string expected,
                  std::string remedy = "");
  // True if `path` and everything below it has no findings: further checks make sense.
  bool is_sound(const Path& path) const;
  // True if `path` itself has no findings.
  bool is_sound_itself(const Path& path) const;

  const std::vector<Finding>& findings() const { return findings_; }

 private:
  std::vector<Finding> findings_;
  std::set<std::string> pointers_;  // of the findings
};

// `Did you mean "colour"?` with the nearest of `candidates` if one has a similar spelling, begins
// with `word` or has it for its last words; else empty.
std::string did_you_mean(std::string_view word, std::span<const std::string> candidates);

}  // namespace pilesim
