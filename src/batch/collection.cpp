#include "batch/collection.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <functional>
#include <map>

#include "batch/appended_file.h"
#include "batch/steps.h"
#include "batch/tar_writer.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/interrupt.h"
#include "core/output_directory.h"
#include "core/temporary_file.h"

namespace pilesim {
namespace {

namespace fs = std::filesystem;

// To be raised when the same jobs give another tar file.
constexpr int kTarVersion = 1;

std::string six_digits(uint64_t value) {
  std::string digits = std::to_string(value);
  return std::string(digits.size() < 6 ? 6 - digits.size() : 0, '0') + digits;
}

void stop_if_interrupted(const fs::path& file) {
  if (!interrupted()) return;
  throw Error(ErrorKind::interrupted, Problem{.file = file.string(),
                                              .found = "was interrupted while it was collected",
                                              .remedy = "The same command goes on from there"});
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

// What one camera of a job has drawn: "run", "run/cameras/left".
struct View {
  std::string name;
  fs::path directory;
};

std::vector<View> views_of(const BatchPlace& place, const BatchJob& job) {
  const fs::path directory = job_directory(place.directory, job);
  std::vector<View> views;
  for (const std::string& name : picture_directories(place.plan, job)) {
    const fs::path pictures = directory / name;
    if (fs::exists(pictures / "frames")) views.push_back({name, pictures});
    for (const fs::path& camera : sorted_entries(pictures / "cameras")) {
      views.push_back({name + "/cameras/" + camera.filename().string(), camera});
    }
  }
  return views;
}

// Jobs that are done, in order.
void each_done(const JobRecords& records, uint64_t begin, uint64_t end, const fs::path& made,
               const std::function<void(const BatchJob&, const JobRecord&)>& visit) {
  records.each(begin, end, [&](const BatchJob& job, const JobRecord& record) {
    if (!record.is_done()) return;
    stop_if_interrupted(made);
    visit(job, record);
  });
}

// Runs `use`, which reads `json` as pilesim writes it.
template <class Use>
void read_own(const fs::path& file, Use use) {
  const Json json = read_json_file(file);
  try {
    use(json);
  } catch (const Json::exception&) {
    throw Error(ErrorKind::input, Problem{.file = file.string(),
                                          .found = "is not as pilesim writes it",
                                          .remedy = "Remove the directory of its job, and make it "
                                                    "anew with the same command"});
  }
}

// Names get numbers from 1 on, in the order in which they come.
class Numbers {
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

// What is there of place(first), place(first + 1), ...: the last one first, so that a removal that
// is killed leaves no gap.
template <class Place>
void remove_from(uint64_t first, Place place) {
  uint64_t end = first;
  while (fs::exists(place(end))) ++end;
  while (end > first) remove_in_one_go(place(--end));
}

// --- coco.json

class CocoCollection {
 public:
  CocoCollection(const BatchPlace& place, CollectionSummary& summary)
      : place_(place),
        summary_(summary),
        images_(place.directory / kCocoFile),
        annotations_(place.directory / kCocoFile) {}

  void add(const BatchJob& job) {
    for (const View& view : views_of(place_, job)) {
      const fs::path file = view.directory / kCocoFile;
      if (fs::exists(file)) read_own(file, [&](const Json& coco) { add(job, view, coco); });
    }
  }

  void finish() {
    if (!has_head_) add_head(Json::object());
    images_.add("\n],\n\"annotations\": [");
    images_.add_all_of(annotations_);
    images_.add("\n],\n\"categories\": " + categories_.dump() + "}\n");
    images_.take_place();
  }

 private:
  void add_head(const Json& info) {
    images_.add("{\"info\": " + info.dump() + ",\n\"licenses\": [],\n\"images\": [");
    has_head_ = true;
  }

  void add(const BatchJob& job, const View& view, const Json& coco) {
    if (!has_head_) add_head(coco.at("info"));
    std::map<Json, uint64_t> category, image;
    for (Json entry : coco.at("categories")) {
      const Json id = entry.at("id");
      entry.erase("id");
      const auto [number, is_new] = numbers_.of(entry.dump());
      category[id] = number;
      entry["id"] = number;
      if (is_new) categories_.push_back(std::move(entry));
    }
    const fs::path place = view.directory.lexically_relative(place_.directory);
    for (Json entry : coco.at("images")) {
      image[entry.at("id")] = ++summary_.pictures;
      entry["id"] = summary_.pictures;
      entry["file_name"] = (place / entry.at("file_name").get<std::string>()).generic_string();
      entry["job"] = job.name();
      images_.add((summary_.pictures == 1 ? "\n" : ",\n") + entry.dump());
    }
    for (Json entry : coco.at("annotations")) {
      entry["id"] = ++summary_.annotations;
      entry["image_id"] = image.at(entry.at("image_id"));
      entry["category_id"] = category.at(entry.at("category_id"));
      annotations_.add((summary_.annotations == 1 ? "\n" : ",\n") + entry.dump());
    }
  }

  const BatchPlace& place_;
  CollectionSummary& summary_;
  AppendedFile images_, annotations_;
  bool has_head_ = false;
  Numbers numbers_;
  Json categories_ = Json::array();
};

// --- bop/

// The same file under another name, or where the file system has no such thing, a copy.
void link_or_copy(const fs::path& from, const fs::path& to) {
  std::error_code fault;
  fs::create_hard_link(from, to, fault);
  if (fault) fs::copy_file(from, to, fault);
  if (fault) throw io_error(to.string(), "cannot be made", fault.value());
}

class BopCollection {
 public:
  BopCollection(const BatchPlace& place, CollectionSummary& summary)
      : place_(place), summary_(summary), root_(place.directory / "bop") {
    make_output_directory(root_ / "models");
    make_output_directory(scenes());
  }

  void add(const BatchJob& job, const JobRecord& record) {
    for (const std::string& name : picture_directories(place_.plan, job)) {
      const fs::path from = job_directory(place_.directory, job) / name / "bop";
      if (!fs::exists(from / "models" / kInfos)) continue;
      const Json objects = add_models(from / "models");
      for (const fs::path& scene : sorted_entries(from / "train_pbr")) {
        const Json source = {{"job", job.name()},
                             {"hash", record.hash},
                             {"scene", (fs::path(name) / scene.filename()).generic_string()},
                             {"objects", objects}};
        add_scene(scene, source);
      }
    }
  }

  void finish() {
    Json infos = Json::object();
    for (size_t i = 0; i < infos_.size(); ++i) infos[std::to_string(i + 1)] = infos_[i];
    write_file_atomically(root_ / "models" / kInfos, infos.dump(2) + '\n');
    // Of an earlier collection of more.
    remove_from(infos_.size() + 1, [&](uint64_t i) { return root_ / "models" / model_name(i); });
    remove_from(summary_.scenes, [&](uint64_t i) { return scenes() / six_digits(i); });
    summary_.models = infos_.size();
  }

 private:
  static constexpr const char* kInfos = "models_info.json";
  static constexpr const char* kSource = "source.json";

  static std::string model_name(uint64_t number) { return "obj_" + six_digits(number) + ".ply"; }
  fs::path scenes() const { return root_ / "train_pbr"; }

  // The job's numbers of its objects, and what they are called here.
  Json add_models(const fs::path& models) {
    Json objects = Json::object();
    read_own(models / kInfos, [&](const Json& infos) {
      for (const auto& [id, info] : infos.items()) {
        const std::string text = read_file(models / model_name(std::stoull(id)));
        const auto [number, is_new] = numbers_.of(content_hash(text));
        objects[id] = number;
        if (!is_new) continue;
        infos_.push_back(info);
        write_file_atomically(root_ / "models" / model_name(number), text);
      }
    });
    return objects;
  }

  void add_scene(const fs::path& from, const Json& source) {
    const fs::path scene = scenes() / six_digits(summary_.scenes++);
    const std::string text = source.dump() + '\n';
    if (fs::exists(scene / kSource) && read_file(scene / kSource) == text) return;
    const fs::path partial = scenes() / ('.' + scene.filename().string() + ".part");
    if (fs::exists(partial)) fs::remove_all(partial);
    make_output_directory(partial);
    for (const char* folder : {"rgb", "depth", "mask", "mask_visib"}) {
      make_output_directory(partial / folder);
      for (const fs::path& file : sorted_entries(from / folder)) {
        link_or_copy(file, partial / folder / file.filename());
      }
    }
    for (const char* file : {"scene_camera.json", "scene_gt_info.json"}) {
      link_or_copy(from / file, partial / file);
    }
    write_file_atomically(partial / "scene_gt.json", with_numbers(from / "scene_gt.json", source));
    write_file_atomically(partial / kSource, text);
    if (fs::exists(scene)) remove_in_one_go(scene);
    std::error_code fault;
    fs::rename(partial, scene, fault);
    if (fault) throw io_error(scene.string(), "cannot be made", fault.value());
  }

  static std::string with_numbers(const fs::path& file, const Json& source) {
    std::string text = "{";
    read_own(file, [&](const Json& poses) {
      for (const auto& [image, bodies] : poses.items()) {
        Json renamed = bodies;
        for (Json& body : renamed) {
          body["obj_id"] =
              source.at("objects").at(std::to_string(body.at("obj_id").get<uint64_t>()));
        }
        text += (text.size() == 1 ? "\n  \"" : ",\n  \"") + image + "\": " + renamed.dump();
      }
    });
    return text + "\n}\n";
  }

  const BatchPlace& place_;
  CollectionSummary& summary_;
  fs::path root_;
  Numbers numbers_;          // of models, by their content
  std::vector<Json> infos_;  // of each
};

// --- tar/

// The pictures of one view of a job, each with all that is told of it.
class ViewSamples {
 public:
  ViewSamples(const BatchJob& job, const JobRecord& record, const View& view, TarWriter& tar)
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
    // What comes after the first point is what WebDataset tells entries of a sample apart by.
    std::string key = job_.name() + '_' + view_.name + '_' + digits;
    std::ranges::replace_if(
        key, [](char c) { return c == '.' || c == '/'; }, '_');
    tar_.add(key + ".rgb.png", read_file(picture));
    for (const fs::path& pass : sorted_entries(view_.directory / "passes")) {
      const std::string name = pass.filename().string();
      const size_t point = name.find('.');
      const std::string extension = pass.extension().string();
      if (extension == ".exr" || name.substr(point + 1) != digits + extension) continue;
      tar_.add(key + '.' + name.substr(0, point) + extension, read_file(pass));
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
  const View& view_;
  TarWriter& tar_;
  Json size_ = Json::object();
  std::map<uint64_t, Json> cameras_, annotations_;  // by frame
};

// Held while a tar file is made: nobody drops what another one packs.
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
  int descriptor_;  // -1: its job is not there, so that nothing is dropped
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
    // What is done stays so: nothing will have to be packed again.
    if (done == end_ - begin_) drop();
  }

 private:
  uint64_t write() const {
    TarWriter tar(tar_);
    uint64_t samples = 0;
    each_done(records_, begin_, end_, tar_, [&](const BatchJob& job, const JobRecord& record) {
      for (const View& view : views_of(place_, job)) {
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
    throw Error(
        ErrorKind::input,
        Problem{.file = (directory / path).string(),
                .found = "is not there: it was packed into a tar file and dropped, and the "
                         "file is to be made anew",
                .remedy = "Remove " + directory.string() + ", so that the job is done again"});
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
  uint64_t begin_, end_;  // jobs
  fs::path tar_, told_;
};

}  // namespace

CollectionSummary pack_tars(const BatchPlace& place, const JobRecords& records, uint64_t begin,
                            uint64_t end) {
  CollectionSummary summary;
  if (!place.plan.collects(Collection::tar)) return summary;
  make_output_directory(place.directory / "tar");
  const auto each = static_cast<uint64_t>(place.plan.tar_jobs);
  for (uint64_t number = (begin + each - 1) / each; number * each < end; ++number) {
    if (std::min((number + 1) * each, place.plan.jobs()) > end) break;
    TarFile(place, records, number).make(summary);
  }
  return summary;
}

CollectionSummary collect_datasets(const BatchPlace& place, const JobRecords& records) {
  CollectionSummary summary = pack_tars(place, records, 0, place.plan.jobs());
  if (place.plan.collects(Collection::tar)) {
    for (const char* kind : {".json", ".tar"}) {
      remove_from(summary.tars,
                  [&](uint64_t i) { return place.directory / "tar" / (six_digits(i) + kind); });
    }
  }
  if (place.plan.collects(Collection::coco)) {
    CocoCollection coco(place, summary);
    each_done(records, 0, place.plan.jobs(), place.directory / kCocoFile,
              [&](const BatchJob& job, const JobRecord&) { coco.add(job); });
    coco.finish();
  }
  if (place.plan.collects(Collection::bop)) {
    BopCollection bop(place, summary);
    each_done(records, 0, place.plan.jobs(), place.directory / "bop",
              [&](const BatchJob& job, const JobRecord& record) { bop.add(job, record); });
    bop.finish();
  }
  return summary;
}

}  // namespace pilesim
