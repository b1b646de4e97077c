#include "render/dataset/coco.h"

#include <string>

#include "core/atomic_file.h"
#include "json/json_text.h"
#include "render/dataset/run_length.h"

namespace pilesim {
namespace {

Json box_of(const PixelBox& box) { return {box.column, box.row, box.width, box.height}; }

Json matrix_rows(const Mat3& matrix) {
  Json rows = Json::array();
  for (int row = 0; row < 3; ++row) {
    rows.push_back({matrix(row, 0), matrix(row, 1), matrix(row, 2)});
  }
  return rows;
}

class CocoWriter final : public AnnotationWriter {
 public:
  CocoWriter(const TrajectoryHeader& header, std::filesystem::path file)
      : header_(header), file_(std::move(file)) {}

  void add(const AnnotatedFrame& frame) override {
    const PassImages& images = frame.images;
    append(images_,
           {{"id", frame.frame},
            {"file_name",
             std::filesystem::relative(frame.picture, file_.parent_path()).generic_string()},
            {"width", images.width},
            {"height", images.height}});
    for (const AnnotatedBody& body : frame.bodies) {
      if (body.visibility.visible_pixels > 0) append(annotations_, annotation(frame, body));
    }
  }

  void finish() override {
    const Json info = {
        {"description",
         "Boxes [x, y, width, height] and masks of what is seen of each body, in pixels from the "
         "upper left corner; masks are run lengths, column by column. \"instance\" is the value in "
         "the instance pass, body of the trajectory + 1; \"visible_share\" is what is seen of what "
         "would be seen of the body alone; a point p of the body is at R p + t in the camera's "
         "frame, in metres."},
        {"version", "1"}};
    std::string categories;
    for (const size_t shape : annotated_shapes(header_)) {
      append(categories, {{"id", shape + 1},
                          {"name", header_.shapes[shape].name},
                          {"supercategory", header_.shapes[shape].type}});
    }
    write_file_atomically(file_, "{\"info\": " + info.dump() +
                                     ",\n\"licenses\": [],\n\"categories\": [" + categories +
                                     "],\n\"images\": [" + images_ + "],\n\"annotations\": [" +
                                     annotations_ + "]}\n");
  }

 private:
  Json annotation(const AnnotatedFrame& frame, const AnnotatedBody& body) const {
    const PassImages& images = frame.images;
    const BodyVisibility& seen = body.visibility;
    const auto is_seen = [&](int column, int row) {
      return images.instance[static_cast<size_t>(row) * static_cast<size_t>(images.width) +
                             static_cast<size_t>(column)] == seen.instance;
    };
    const Quat turn = frame.poses.orientation[body.body].cast<double>().normalized();
    const Vec3 place = frame.camera.in_camera(frame.poses.position[body.body]);
    const std::vector<uint32_t> runs =
        run_lengths(images.width, images.height, seen.visible_box, is_seen);
    return {{"id", frame.frame * header_.body_count() + body.body + 1},
            {"image_id", frame.frame},
            {"category_id", seen.shape},
            {"bbox", box_of(seen.visible_box)},
            {"area", seen.visible_pixels},
            {"segmentation",
             {{"size", {images.height, images.width}}, {"counts", compressed_runs(runs)}}},
            {"iscrowd", 0},
            {"instance", seen.instance},
            {"visible_share", seen.visible_share()},
            {"R", matrix_rows(frame.camera.rotation * turn.toRotationMatrix())},
            {"t", {place.x(), place.y(), place.z()}}};
  }

  // As text: of a large pile there are millions.
  static void append(std::string& list, const Json& entry) {
    list += list.empty() ? "\n" : ",\n";
    list += entry.dump();
  }

  const TrajectoryHeader& header_;
  std::filesystem::path file_;
  std::string images_, annotations_;
};

}  // namespace

std::unique_ptr<AnnotationWriter> make_coco_writer(const TrajectoryHeader& header,
                                                   const std::filesystem::path& file) {
  return std::make_unique<CocoWriter>(header, file);
}

}  // namespace pilesim
