#include "batch/collected_jobs.h"

#include <algorithm>

#include "batch/steps.h"
#include "core/interrupt.h"
#include "core/temporary_file.h"

namespace pilesim {
namespace {

namespace fs = std::filesystem;

void stop_if_interrupted(const fs::path& file) {
  if (!interrupted()) return;
  throw Error(ErrorKind::interrupted, Problem{.file = file.string(),
                                              .found = "was interrupted while it was collected",
                                              .remedy = "The same command goes on from there"});
}

}  // namespace

std::string six_digits(uint64_t value) {
  std::string digits = std::to_string(value);
  return std::string(digits.size() < 6 ? 6 - digits.size() : 0, '0') + digits;
}

std::vector<fs::path> sorted_entries(const fs::path& directory) {
  std::vector<fs::path> entries;
  std::error_code fault;
  for (const auto& entry : fs::directory_iterator(directory, fault)) {
    if (!entry.path().filename().string().starts_with('.')) entries.push_back(entry.path());
  }
  std::ranges::sort(entries);
  return entries;
}

std::vector<JobView> views_of(const BatchPlace& place, const BatchJob& job) {
  const fs::path directory = job_directory(place.directory, job);
  std::vector<JobView> views;
  for (const std::string& name : picture_directories(place.plan, job)) {
    const fs::path pictures = directory / name;
    if (fs::exists(pictures / "frames")) views.push_back({name, pictures});
    for (const fs::path& camera : sorted_entries(pictures / "cameras")) {
      views.push_back({name + "/cameras/" + camera.filename().string(), camera});
    }
  }
  return views;
}

void each_done(const JobRecords& records, uint64_t begin, uint64_t end, const fs::path& made,
               const std::function<void(const BatchJob&, const JobRecord&)>& visit) {
  records.each(begin, end, [&](const BatchJob& job, const JobRecord& record) {
    if (!record.is_done()) return;
    stop_if_interrupted(made);
    visit(job, record);
  });
}

void read_own(const fs::path& file, const std::function<void(const Json&)>& use) {
  const Json json = read_json_file(file);
  try {
    use(json);
  } catch (const Json::exception&) {
    throw Error(
        ErrorKind::input,
        Problem{
            .file = file.string(),
            .found = "is not as pilesim writes it",
            .remedy = "Remove the directory of its job, and make it again with the same command"});
  }
}

void remove_from(uint64_t first, const std::function<fs::path(uint64_t)>& place) {
  uint64_t end = first;
  while (fs::exists(place(end))) ++end;
  while (end > first) remove_in_one_go(place(--end));
}

}  // namespace pilesim
