#include "batch/job_records.h"

#include <algorithm>

#include "core/error.h"

namespace pilesim {
namespace fs = std::filesystem;

JobRecords::JobRecords(const BatchPlace& place, bool with_shards) : place_(place) {
  if (!with_shards) return;
  std::vector<fs::path> files;
  std::error_code fault;
  for (const auto& entry : fs::directory_iterator(place.directory / "shards", fault)) {
    if (entry.path().extension() == ".jsonl") files.push_back(entry.path());
  }
  std::ranges::sort(files);
  for (const fs::path& file : files) add_shard(file);
  std::ranges::stable_sort(lines_, {}, &Line::job);
}

void JobRecords::add_shard(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  uint64_t offset = 0;
  for (std::string line; std::getline(stream, line); offset += line.size() + 1) {
    const JobRecord record = parse_record(line, file.string());
    // A job that failed in one shard may have succeeded in another.
    if (!record.is_done()) continue;
    lines_.push_back({.job = record.index,
                      .offset = offset,
                      .file = static_cast<uint32_t>(shards_.size()),
                      .length = static_cast<uint32_t>(line.size())});
  }
  if (stream.bad()) throw io_error(file.string(), "cannot be read", errno);
  shards_.push_back(file);
}

std::optional<JobRecord> JobRecords::find(const BatchJob& job) const {
  for (auto line = std::ranges::lower_bound(lines_, job.index, {}, &Line::job);
       line != lines_.end() && line->job == job.index; ++line) {
    const fs::path& file = shards_[line->file];
    if (open_ != line->file) stream_ = std::ifstream(file, std::ios::binary);
    open_ = line->file;
    std::string text(line->length, '\0');
    stream_.seekg(static_cast<std::streamoff>(line->offset));
    if (!stream_.read(text.data(), line->length)) {
      throw io_error(file.string(), "cannot be read", errno);
    }
    JobRecord record = parse_record(text, file.string());
    if (record.key == place_.keys.key(job)) return record;
  }
  return find_job(place_.directory, job);
}

void JobRecords::each(uint64_t begin, uint64_t end,
                      const std::function<void(const BatchJob&, const JobRecord&)>& visit) const {
  for (uint64_t index = begin; index < end; ++index) {
    const BatchJob job = batch_job(place_.plan, index);
    if (const std::optional<JobRecord> record = find(job)) visit(job, *record);
  }
}

}  // namespace pilesim
