// Pinned hashes of results, in a file of lines "name hash"; '#' starts a comment line.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <utility>

#include "core/atomic_file.h"

namespace pilesim::test {

class PinnedHashes {
 public:
  explicit PinnedHashes(std::filesystem::path file) : file_(std::move(file)) {
    std::istringstream text(read_file(file_));
    for (std::string line; std::getline(text, line);) {
      std::istringstream words(line);
      std::string name, hash;
      if (line.starts_with('#')) {
        comments_ += line + '\n';
      } else if (words >> name >> hash) {
        hashes_[name] = hash;
      }
    }
  }

  const std::map<std::string, std::string>& hashes() const { return hashes_; }

  // Fails with the line to pin, or pins it if PILESIM_PIN_HASHES is in the environment. A repeated
  // request must give the same hash even then.
  void expect(const std::string& name, const std::string& hash) {
    const bool is_first = seen_.insert(name).second;
    std::string& pinned = hashes_[name];
    if (pinned == hash) return;
    if (std::getenv("PILESIM_PIN_HASHES") != nullptr && is_first) {
      pinned = hash;
      std::string text = comments_;
      for (const auto& [each, value] : hashes_) text += each + ' ' + value + '\n';
      write_file_atomically(file_, text);
    } else {
      ADD_FAILURE() << "Other bytes than those that " << file_.filename().string() << " pins:\n"
                    << name << ' ' << (pinned.empty() ? "(nothing)" : pinned)
                    << "\nThe line for what they are now:\n"
                    << name << ' ' << hash;
    }
  }

 private:
  std::filesystem::path file_;
  std::string comments_;
  std::map<std::string, std::string> hashes_;  // by name
  std::set<std::string> seen_;
};

}  // namespace pilesim::test
