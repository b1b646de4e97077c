#include "batch/tar_collection.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <map>

#include "batch/collected_jobs.h"
#include "batch/tar_writer.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/output_directory.h"
#include "core/temporary_file.h"

namespace pilesim {
namespace {

namespace fs = std::filesystem;

// Raise it when the same jobs give another tar file.
constexpr int kTarVersion = 2;

// The pictures of one view of a job, with their annotations.
class ViewSamples {
 public:
  ViewSamples(const BatchJob& job, const JobRecord& record, const JobView& view, TarWriter& tar)
      : job_(job), record_(record), view_(view), tar_(tar) {}

  uint64_t add_all() {
    read_files();
    uint64_t count = 0;
    for (const fs::path& picture : sorted_entries(view_.directory / "frames")) {
      const std::string name = picture.filename().string();
      // frame.0089.png
      if (!name.starts_with("frame.") || picture.extension() != ".png") continue;
      add(picture, name.substr(6, name.size() - 10));
      ++count;
    }
    return count;
  }

 private:
  void read_files() {
    const fs::path cameras = view_.directory / kCamerasFile, coco = view_.directory / kCocoFile;
    if (fs::exists(cameras)) {
      read_own(cameras, [&](const Json& json) {
        size_ = {{"width", json.at("width")}, {"height", json.at("height")}};
        for (const Json& frame : json.at("frames")) cameras_[frame.at("frame")] = frame;
      });
    }
    if (!fs::exists(coco)) return;
    read_own(coco, [&](const Json& json) {
      std::map<Json, Json> names;
      for (const Json& category : json.at("categories")) {
        names[category.at("id")] = category.at("name");
      }
      for (Json annotation : json.at("annotations")) {
        const uint64_t frame = annotation.at("image_id");
        annotation["category"] = names.at(annotation.at("category_id"));
        for (const char* key : {"id", "image_id", "category_id"}) annotation.erase(key);
        annotations_[frame].push_back(std::move(annotation));
      }
    });
  }

  void add(const fs::path& picture, const std::string& digits) {
    // WebDataset distinguishes a sample's entries by the part after the first point.
    std::string key = job_.name() + '_' + view_.name + '_' + digits;
    std::ranges::replace_if(
        key, [](char c) { return c == '.' || c == '/'; }, '_');
    tar_.add(key + ".rgb.png", read_file(picture));
    for (const fs::path& pass : sorted_entries(view_.directory / "passes")) {
      const std::string name = pass.filename().string();
      const size_t point = name.find('.');
      const std::string extension = pass.extension().string();
      if (name.substr(point + 1) != digits + extension) continue;
      // frame.0089.exr contains all passes.
      const std::string what = extension == ".exr" ? "passes" : name.substr(0, point);
      tar_.add(key + '.' + what + extension, read_file(pass));
    }
    const uint64_t frame = std::stoull(digits);
    Json told = {{"job", job_.name()},
                 {"view", view_.name},
                 {"frame", frame},
                 {"seed", record_.attempts.back().seed},
                 {"values", record_.values}};
    told.update(size_);
    if (cameras_.contains(frame)) told.update(cameras_.at(frame));
    if (annotations_.contains(frame)) told["annotations"] = annotations_.at(frame);
    tar_.add(key + ".json", told.dump());
  }

  const BatchJob& job_;
  const JobRecord& record_;
  const JobView& view_;
  TarWriter& tar_;
  Json size_ = Json::object();
  std::map<uint64_t, Json> cameras_, annotations_;  // by frame
};

// Held while a tar file is written: no other process may drop its files.
class FolderLock {
 public:
  explicit FolderLock(const fs::path& folder)
      : descriptor_(open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
    if (descriptor_ >= 0) flock(descriptor_, LOCK_EX);
  }
  ~FolderLock() {
    if (descriptor_ >= 0) close(descriptor_);
  }
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int descriptor_;  // -1: the job is missing, and nothing is dropped
};

class TarFile {
 public:
  TarFile(const BatchPlace& place, const JobRecords& records, uint64_t number)
      : place_(place),
        records_(records),
        begin_(number * static_cast<uint64_t>(place.plan.tar_jobs)),
        end_(std::min(begin_ + static_cast<uint64_t>(place.plan.tar_jobs), place.plan.jobs())),
        tar_(place.directory / "tar" / (six_digits(number) + ".tar")),
        told_(fs::path(tar_).replace_extension(".json")) {}

  void make(CollectionSummary& summary) {
    const FolderLock lock(job_directory(place_.directory, batch_job(place_.plan, begin_)));
    Hasher hasher;
    uint64_t done = 0;
    each_done(records_, begin_, end_, tar_, [&](const BatchJob&, const JobRecord& record) {
      ++done;
      const std::string text = record.key + record.hash;
      hasher.add(std::as_bytes(std::span(text)));
    });
    const std::string jobs = hasher.digest();
    Json told = {{"version", kTarVersion}, {"jobs", jobs}, {"packed", done}};
    uint64_t samples = 0;
    bool is_there = false;
    if (fs::exists(told_) && fs::exists(tar_)) {
      read_own(told_, [&](const Json& json) {
        samples = json.at("samples");
        told["samples"] = samples;
        is_there = json == told;
      });
    }
    if (!is_there) {
      samples = write();
      told["samples"] = samples;
      write_file_atomically(told_, told.dump() + '\n');
    }
    ++summary.tars;
    summary.samples += samples;
    summary.packed += done;
    // Finished jobs stay finished, so nothing needs packing again.
    if (done == end_ - begin_) drop();
  }

 private:
  uint64_t write() const {
    TarWriter tar(tar_);
    uint64_t samples = 0;
    each_done(records_, begin_, end_, tar_, [&](const BatchJob& job, const JobRecord& record) {
      for (const JobView& view : views_of(place_, job)) {
        samples += ViewSamples(job, record, view, tar).add_all();
      }
      for (const std::string& path : place_.plan.drop_packed) require(job, path);
    });
    tar.take_place();
    return samples;
  }

  void require(const BatchJob& job, const std::string& path) const {
    const fs::path directory = job_directory(place_.directory, job);
    if (fs::exists(directory / path)) return;
    throw Error(ErrorKind::input, Problem{.file = (directory / path).string(),
                                          .found = "does not exist: it was packed into a tar file "
                                                   "and dropped, and the file must be made again",
                                          .remedy = "Remove " + directory.string() +
                                                    ", so that the job is done again"});
  }

  void drop() const {
    records_.each(begin_, end_, [&](const BatchJob& job, const JobRecord&) {
      for (const std::string& path : place_.plan.drop_packed) {
        const fs::path whole = job_directory(place_.directory, job) / path;
        if (fs::exists(whole)) remove_in_one_go(whole);
      }
    });
  }

  const BatchPlace& place_;
  const JobRecords& records_;
  uint64_t begin_, end_;  // range of jobs
  fs::path tar_, told_;
};

}  // namespace

void collect_tars(const BatchPlace& place, const JobRecords& records, uint64_t begin, uint64_t end,
                  CollectionSummary& summary) {
  make_output_directory(place.directory / "tar");
  const auto each = static_cast<uint64_t>(place.plan.tar_jobs);
  for (uint64_t number = (begin + each - 1) / each; number * each < end; ++number) {
    if (std::min((number + 1) * each, place.plan.jobs()) > end) break;
    TarFile(place, records, number).make(summary);
  }
}

void remove_tars_from(const BatchPlace& place, uint64_t first) {
  for (const char* kind : {".json", ".tar"}) {
    remove_from(first,
                [&](uint64_t i) { return place.directory / "tar" / (six_digits(i) + kind); });
  }
}

}  // namespace pilesim
