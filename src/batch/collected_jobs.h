// Shared by all collections of a batch: the finished jobs and their pictures.
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

// "000012": at least six digits.
std::string six_digits(uint64_t value);

// All entries except hidden ones, in order; none if the directory is missing.
std::vector<std::filesystem::path> sorted_entries(const std::filesystem::path& directory);

// The pictures of one camera of a job: "run", "run/cameras/left".
struct JobView {
  std::string name;
  std::filesystem::path directory;
};
std::vector<JobView> views_of(const BatchPlace& place, const BatchJob& job);

// Visits finished jobs in order. Throws Error(interrupted) that names `made` after Ctrl-C.
void each_done(const JobRecords& records, uint64_t begin, uint64_t end,
               const std::filesystem::path& made,
               const std::function<void(const BatchJob&, const JobRecord&)>& visit);

// Runs `use` on the file's JSON, in pilesim's own format. Throws Error(input) if the format
// differs.
void read_own(const std::filesystem::path& file, const std::function<void(const Json&)>& use);

// Numbers names from 1 in order of first appearance.
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

// Removes the existing ones of place(first), place(first + 1), ..., the last one first, so that an
// interrupted removal leaves no gap.
void remove_from(uint64_t first, const std::function<std::filesystem::path(uint64_t)>& place);

}  // namespace pilesim
