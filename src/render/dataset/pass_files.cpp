#include "render/dataset/pass_files.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>

#include "core/atomic_file.h"
#include "core/text.h"
#include "json/json_text.h"
#include "render/dataset/numeric_png.h"
#include "render/exr.h"

namespace pilesim {
namespace {

namespace fs = std::filesystem;

constexpr uint32_t kMost16 = std::numeric_limits<uint16_t>::max();

fs::path file_of(const fs::path& directory, const std::string& stem, uint64_t frame,
                 const std::string& ending) {
  char digits[32];
  std::snprintf(digits, sizeof digits, ".%04llu.", static_cast<unsigned long long>(frame));
  return directory / (stem + digits + ending);
}

bool has(const std::vector<Pass>& passes, Pass pass) {
  return std::ranges::find(passes, pass) != passes.end();
}

void write_exr_layers(const std::vector<Pass>& passes, const PassImages& images,
                      const fs::path& file) {
  std::vector<ExrChannel> channels;
  if (has(passes, Pass::depth)) channels.push_back({"depth.Z", images.depth.data()});
  if (has(passes, Pass::ids)) channels.push_back({"ids.I", images.instance.data()});
  if (has(passes, Pass::shapes)) channels.push_back({"shapes.I", images.shape.data()});
  if (has(passes, Pass::normals)) {
    for (size_t i = 0; i < 3; ++i) {
      channels.push_back({std::string("normals.") + "XYZ"[i], images.normal.data() + i, 3});
    }
  }
  if (has(passes, Pass::motion)) {
    for (size_t i = 0; i < 2; ++i) {
      channels.push_back({std::string("motion.") + "XY"[i], images.motion.data() + i, 2});
    }
  }
  if (!channels.empty()) write_exr(file, images.width, images.height, channels);
}

void write_ids(const PassImages& images, const std::vector<uint32_t>& ids, const fs::path& file) {
  write_png16(file, images.width, images.height, std::vector<uint16_t>(ids.begin(), ids.end()));
}

void write_normals(const PassImages& images, const fs::path& file) {
  std::vector<uint16_t> values;
  values.reserve(images.normal.size());
  for (size_t i = 0; i < images.normal.size(); ++i) {
    const bool nothing = images.instance[i / 3] == kNoInstance;
    // 0 is left to what is nothing; 32768 stands for 0.
    values.push_back(nothing
                         ? uint16_t{0}
                         : static_cast<uint16_t>(32768 + std::lround(32767 * images.normal[i])));
  }
  write_png16(file, images.width, images.height, values);
}

std::string box_text(const PixelBox& box) {
  return std::to_string(box.column) + ',' + std::to_string(box.row) + ',' +
         std::to_string(box.width) + ',' + std::to_string(box.height);
}

void write_visibility(const PassImages& images, const fs::path& file) {
  std::string text =
      "instance,shape,visible_pixels,pixels_inside,pixels_alone,visible_share,visible_x,visible_y,"
      "visible_width,visible_height,alone_x,alone_y,alone_width,alone_height\n";
  for (const BodyVisibility& body : images.visibility) {
    text += std::to_string(body.instance) + ',' + std::to_string(body.shape) + ',' +
            std::to_string(body.visible_pixels) + ',' + std::to_string(body.pixels_inside) + ',' +
            std::to_string(body.pixels_alone) + ',' + with_digits(body.visible_share(), 6) + ',' +
            box_text(body.visible_box) + ',' + box_text(body.alone_box) + '\n';
  }
  write_file_atomically(file, text);
}

const char* meaning(Pass pass) {
  switch (pass) {
    case Pass::depth:
      return "EXR depth.Z: metres along the camera's axis, infinity where nothing is. PNG: whole "
             "units, of which cameras.json says how many millimetres each is; 0 where nothing is "
             "or "
             "where it is too far for 16 bits.";
    case Pass::ids:
      return "EXR ids.I, PNG: body of the trajectory + 1, 0 where nothing is.";
    case Pass::shapes:
      return "EXR shapes.I, PNG: shape of the trajectory + 1, 0 where nothing is.";
    case Pass::normals:
      return "EXR normals.X, .Y, .Z: unit vector in the camera's frame (x right, y down, z away "
             "from the camera), of the triangle, towards the camera. PNG: 32768 + 32767 times "
             "that; 0 where nothing is.";
    case Pass::motion:
      return "EXR motion.X, .Y: pixels right and down to where what is seen here will be in the "
             "next frame of the trajectory; NaN where nothing is, in the last frame, and of what "
             "is gone or behind the camera then.";
    case Pass::visibility:
      return "CSV: a line a body that would cover at least a pixel alone. visible_pixels: seen; "
             "pixels_inside: of the body alone; pixels_alone: the same, also up to the picture's "
             "width and height beyond its sides; visible_share: visible_pixels / pixels_alone.";
  }
  return "";
}

}  // namespace

void write_pass_conventions(const TrajectoryHeader& header, const std::vector<Pass>& passes,
                            const fs::path& directory) {
  Json json = {{"rays", "one a pixel, through its middle: a pixel belongs to one body"}};
  for (const PassName& each : kPassNames) {
    if (has(passes, each.pass)) json["passes"][std::string(each.name)] = meaning(each.pass);
  }
  json["instances"] = header.body_name;
  Json& shapes = json["shapes"] = Json::array();
  for (const TrajectoryShape& shape : header.shapes) shapes.push_back(shape.name);
  write_file_atomically(directory / "passes.json", json.dump(1) + "\n");
}

void write_passes(const TrajectoryHeader& header, const std::vector<Pass>& passes, uint64_t frame,
                  const PassImages& images, const DepthImage& depth, const fs::path& directory) {
  write_exr_layers(passes, images, file_of(directory, "frame", frame, "exr"));
  if (has(passes, Pass::depth)) {
    write_png16(file_of(directory, "depth", frame, "png"), images.width, images.height,
                depth.values);
  }
  // Only the EXR file has ids of more bodies than 16 bits can number.
  if (has(passes, Pass::ids) && header.body_count() <= kMost16) {
    write_ids(images, images.instance, file_of(directory, "ids", frame, "png"));
  }
  if (has(passes, Pass::shapes) && header.shapes.size() <= kMost16) {
    write_ids(images, images.shape, file_of(directory, "shapes", frame, "png"));
  }
  if (has(passes, Pass::normals)) {
    write_normals(images, file_of(directory, "normals", frame, "png"));
  }
  if (has(passes, Pass::visibility)) {
    write_visibility(images, file_of(directory, "visibility", frame, "csv"));
  }
}

}  // namespace pilesim
