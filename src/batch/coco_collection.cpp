#include "batch/coco_collection.h"

#include <map>

#include "batch/appended_file.h"
#include "batch/collected_jobs.h"
#include "core/output_directory.h"

namespace pilesim {
namespace {

namespace fs = std::filesystem;

class CocoCollection {
 public:
  CocoCollection(const BatchPlace& place, CollectionSummary& summary)
      : place_(place),
        summary_(summary),
        images_(place.directory / kCocoFile),
        annotations_(place.directory / kCocoFile) {}

  void add(const BatchJob& job) {
    for (const JobView& view : views_of(place_, job)) {
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

  void add(const BatchJob& job, const JobView& view, const Json& coco) {
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
  NameNumbers numbers_;
  Json categories_ = Json::array();
};

}  // namespace

void collect_coco(const BatchPlace& place, const JobRecords& records, CollectionSummary& summary) {
  CocoCollection coco(place, summary);
  each_done(records, 0, place.plan.jobs(), place.directory / kCocoFile,
            [&](const BatchJob& job, const JobRecord&) { coco.add(job); });
  coco.finish();
}

}  // namespace pilesim
