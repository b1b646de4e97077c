#include "batch/bop_collection.h"

#include <vector>

#include "batch/collected_jobs.h"
#include "batch/steps.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/output_directory.h"
#include "core/temporary_file.h"

namespace pilesim {
namespace {

namespace fs = std::filesystem;

// A hard link, or a copy where the file system supports none.
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
    // Remove the rest of an earlier, larger collection.
    remove_from(infos_.size() + 1, [&](uint64_t i) { return root_ / "models" / model_name(i); });
    remove_from(summary_.scenes, [&](uint64_t i) { return scenes() / six_digits(i); });
    summary_.models = infos_.size();
  }

 private:
  static constexpr const char* kInfos = "models_info.json";
  static constexpr const char* kSource = "source.json";

  static std::string model_name(uint64_t number) { return "obj_" + six_digits(number) + ".ply"; }
  fs::path scenes() const { return root_ / "train_pbr"; }

  // Maps the job's object numbers to those of the collection.
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
  NameNumbers numbers_;      // of models, by content
  std::vector<Json> infos_;  // by model
};

}  // namespace

void collect_bop(const BatchPlace& place, const JobRecords& records, CollectionSummary& summary) {
  BopCollection bop(place, summary);
  each_done(records, 0, place.plan.jobs(), place.directory / "bop",
            [&](const BatchJob& job, const JobRecord& record) { bop.add(job, record); });
  bop.finish();
}

}  // namespace pilesim
