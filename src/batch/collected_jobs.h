// The common part of collections of a batch: the jobs that are done, and the pictures of each.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "batch/job_records.h"
#include "core/error.h"

namespace pilesim {

// "000012": six digits or more.
std::string six_digits(uint64_t value);

// All but hidden ones, in order; none where the directory is not there.
std::vector<std::filesystem::path> sorted_entries(const std::filesystem::path& directory);

// The pictures of one camera of a job: "run", "run/cameras/left".
struct JobView {
  std::string name;
  std::filesystem::path directory;
};
std::vector<JobView> views_of(const BatchPlace& place, const BatchJob& job);

// Jobs that are done, in order. Throws Error(interrupted), naming `made`, after Ctrl-C.
void each_done(const JobRecords& records, uint64_t begin, uint64_t end,
               const std::filesystem::path& made,
               const std::function<void(const BatchJob&, const JobRecord&)>& visit);

// Runs `use`, which reads the file's JSON as pilesim writes it. Throws Error(input) where it is
// another.
void read_own(const std::filesystem::path& file, const std::function<void(const Json&)>& use);

// Names get numbers from 1 on, in the order in which they come.
class NameNumbers {
 public:
  struct Given {
    uint64_t number = 0;
    bool is_new = false;
  };
  Given of(const std::string& name) {
    const auto [entry, is_new] = numbers_.try_emplace(name, numbers_.size() + 1);
    return {entry->second, is_new};
  }

 private:
  std::map<std::string, uint64_t> numbers_;
};

// Removes what is there of place(first), place(first + 1), ...: the last one first, so that a
// removal that is killed leaves no gap.
void remove_from(uint64_t first, const std::function<std::filesystem::path(uint64_t)>& place);

}  // namespace pilesim
