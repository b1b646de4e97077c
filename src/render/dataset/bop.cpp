#include "render/dataset/bop.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <string>

#include "core/atomic_file.h"
#include "core/output_directory.h"
#include "core/text.h"
#include "geometry/symmetry.h"
#include "json/json_text.h"
#include "render/dataset/numeric_png.h"
#include "render/render_mesh.h"

namespace pilesim {
namespace {

namespace fs = std::filesystem;

constexpr double kMillimetres = 1000;
// A turned shape that matches itself within this share of the diameter is symmetric.
constexpr double kSymmetric = 0.01;

std::string number(uint64_t value) {
  char text[32];
  std::snprintf(text, sizeof text, "%06llu", static_cast<unsigned long long>(value));
  return text;
}

// Row by row.
Json rows_of(const Mat3& matrix) {
  Json rows = Json::array();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) rows.push_back(matrix(row, column));
  }
  return rows;
}
Json millimetres(const Vec3& point) {
  return {kMillimetres * point.x(), kMillimetres * point.y(), kMillimetres * point.z()};
}

// The toolkit's boxes: width and height from the first column and row to the last.
Json box_of(const PixelBox& box, bool is_there) {
  if (!is_there) return {-1, -1, -1, -1};
  return {box.column, box.row, box.width - 1, box.height - 1};
}

// The largest distance between two vertices. Those far from the middle come first: no pair is left
// out that could be it.
double diameter(const std::vector<Vec3f>& vertices) {
  Eigen::AlignedBox3f box;
  for (const Vec3f& vertex : vertices) box.extend(vertex);
  std::vector<std::pair<double, size_t>> order;
  for (size_t i = 0; i < vertices.size(); ++i) {
    order.emplace_back((vertices[i] - box.center()).norm(), i);
  }
  std::ranges::sort(order, std::greater());
  double most = 0;
  for (size_t i = 0; i < order.size(); ++i) {
    for (size_t k = 0; k < i && order[i].first + order[k].first > most; ++k) {
      const Vec3f apart = vertices[order[i].second] - vertices[order[k].second];
      most = std::max(most, apart.cast<double>().norm());
    }
  }
  return most;
}

// With vertex normals, as the format wants it: those that pictures are drawn with.
void write_ply(const TrajectoryShape& shape, const fs::path& file) {
  const RenderMesh mesh = make_render_mesh(shape.vertices, shape.triangles);
  const MeshLevel& full = mesh.levels.front();
  const uint32_t end = mesh.levels.size() > 1 ? mesh.levels[1].first_vertex
                                              : static_cast<uint32_t>(mesh.vertices.size());
  std::string text =
      "ply\nformat ascii 1.0\ncomment millimetres, body frame\nelement vertex " +
      std::to_string(end - full.first_vertex) +
      "\nproperty float x\nproperty float y\nproperty float z\nproperty float nx\nproperty float "
      "ny\nproperty float nz\nelement face " +
      std::to_string(full.index_count / 3) +
      "\nproperty list uchar int vertex_indices\nend_header\n";
  const auto add = [&](double value, char after) { text += with_digits(value, 9) + after; };
  for (uint32_t i = full.first_vertex; i < end; ++i) {
    for (const float x : mesh.vertices[i].position) add(kMillimetres * x, ' ');
    const auto& normal = mesh.vertices[i].normal;
    add(normal[0], ' ');
    add(normal[1], ' ');
    add(normal[2], '\n');
  }
  for (uint32_t i = 0; i < full.index_count; i += 3) {
    text += '3';
    for (uint32_t k = 0; k < 3; ++k) {
      text += ' ' + std::to_string(mesh.indices[full.first_index + i + k]);
    }
    text += '\n';
  }
  write_file_atomically(file, text);
}

// Without the rounding of what is 0 or 1.
double rounded(double value) { return std::round(1e12 * value) / 1e12 + 0.0; }

// By its form alone, not by what is painted on it.
void add_symmetries(const TrajectoryShape& shape, double diameter_m, Json& info) {
  TriangleMesh mesh;
  for (const Vec3f& vertex : shape.vertices) mesh.vertices.push_back(vertex.cast<double>());
  mesh.triangles = shape.triangles;
  const Symmetries symmetries = find_symmetries(mesh, kSymmetric * diameter_m);
  for (const Mat3& turn : symmetries.discrete) {
    Json rows = Json::array();
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) rows.push_back(rounded(turn(row, column)));
      rows.push_back(0);
    }
    for (const int value : {0, 0, 0, 1}) rows.push_back(value);
    info["symmetries_discrete"].push_back(rows);
  }
  for (const Vec3& axis : symmetries.continuous) {
    info["symmetries_continuous"].push_back(
        {{"axis", {rounded(axis.x()), rounded(axis.y()), rounded(axis.z())}},
         {"offset", {0, 0, 0}}});
  }
}

Json model_info(const TrajectoryShape& shape) {
  Eigen::AlignedBox3f box;
  for (const Vec3f& vertex : shape.vertices) box.extend(vertex);
  const Vec3 low = kMillimetres * box.min().cast<double>();
  const Vec3 size = kMillimetres * box.sizes().cast<double>();
  const double diameter_m = diameter(shape.vertices);
  Json info = {{"diameter", kMillimetres * diameter_m},
               {"min_x", low.x()},
               {"min_y", low.y()},
               {"min_z", low.z()},
               {"size_x", size.x()},
               {"size_y", size.y()},
               {"size_z", size.z()}};
  add_symmetries(shape, diameter_m, info);
  return info;
}

class BopWriter final : public AnnotationWriter {
 public:
  BopWriter(const TrajectoryHeader& header, fs::path directory)
      : header_(header), directory_(std::move(directory)) {
    for (const char* folder : {"rgb", "depth", "mask", "mask_visib"}) {
      make_output_directory(directory_ / folder);
    }
  }

  void add(const AnnotatedFrame& frame) override {
    const PassImages& images = frame.images;
    const std::string image = number(frame.frame);
    write_file_atomically(directory_ / "rgb" / (image + ".png"), read_file(frame.picture));
    write_png16(directory_ / "depth" / (image + ".png"), images.width, images.height,
                frame.depth.values);
    Json poses = Json::array(), infos = Json::array();
    for (size_t i = 0; i < frame.bodies.size(); ++i) {
      poses.push_back(pose_of(frame, frame.bodies[i]));
      infos.push_back(write_masks(frame, frame.bodies[i], image + '_' + number(i) + ".png"));
    }
    const std::string key = std::to_string(frame.frame);
    append(cameras_, key, camera_of(frame));
    append(poses_, key, poses);
    append(infos_, key, infos);
  }

  void finish() override {
    write_file_atomically(directory_ / "scene_camera.json", "{" + cameras_ + "\n}\n");
    write_file_atomically(directory_ / "scene_gt.json", "{" + poses_ + "\n}\n");
    write_file_atomically(directory_ / "scene_gt_info.json", "{" + infos_ + "\n}\n");
  }

 private:
  static Json camera_of(const AnnotatedFrame& frame) {
    Mat3 k = Mat3::Identity();
    k(0, 0) = frame.camera.fx;
    k(1, 1) = frame.camera.fy;
    k(0, 2) = frame.camera.cx;
    k(1, 2) = frame.camera.cy;
    return {{"cam_K", rows_of(k)},
            {"cam_R_w2c", rows_of(frame.camera.rotation)},
            {"cam_t_w2c", millimetres(frame.camera.translation)},
            {"depth_scale", frame.depth.unit_mm}};
  }

  Json pose_of(const AnnotatedFrame& frame, const AnnotatedBody& body) const {
    const Quat turn = frame.poses.orientation[body.body].cast<double>().normalized();
    return {{"cam_R_m2c", rows_of(frame.camera.rotation * turn.toRotationMatrix())},
            {"cam_t_m2c", millimetres(frame.camera.in_camera(frame.poses.position[body.body]))},
            {"obj_id", header_.body_shape[body.body] + 1}};
  }

  // And what scene_gt_info.json says of them.
  Json write_masks(const AnnotatedFrame& frame, const AnnotatedBody& body,
                   const std::string& name) const {
    const PassImages& images = frame.images;
    std::vector<uint8_t> alone(images.instance.size()), seen(images.instance.size());
    uint64_t valid = 0;
    const PixelBox& box = body.alone.box;
    for (int row = std::max(0, box.row); row < std::min(images.height, box.row + box.height);
         ++row) {
      for (int column = std::max(0, box.column);
           column < std::min(images.width, box.column + box.width); ++column) {
        const size_t in_box = static_cast<size_t>(row - box.row) * static_cast<size_t>(box.width) +
                              static_cast<size_t>(column - box.column);
        if (body.alone.covered[in_box] == 0) continue;
        const size_t at = static_cast<size_t>(row) * static_cast<size_t>(images.width) +
                          static_cast<size_t>(column);
        alone[at] = 255;
        if (frame.depth.values[at] != 0) ++valid;
        if (images.instance[at] == body.visibility.instance) seen[at] = 255;
      }
    }
    write_png8(directory_ / "mask" / name, images.width, images.height, alone);
    write_png8(directory_ / "mask_visib" / name, images.width, images.height, seen);
    const BodyVisibility& told = body.visibility;
    const bool is_seen = told.visible_pixels > 0;
    return {{"bbox_obj", box_of(told.alone_box, is_seen)},
            {"bbox_visib", box_of(told.visible_box, is_seen)},
            {"px_count_all", told.pixels_alone},
            {"px_count_valid", valid},
            {"px_count_visib", told.visible_pixels},
            {"visib_fract", told.visible_share()}};
  }

  static void append(std::string& object, const std::string& key, const Json& value) {
    object += (object.empty() ? "\n  \"" : ",\n  \"") + key + "\": " + value.dump();
  }

  const TrajectoryHeader& header_;
  fs::path directory_;
  std::string cameras_, poses_, infos_;
};

}  // namespace

void write_bop_models(const TrajectoryHeader& header, const fs::path& root) {
  make_output_directory(root / "models");
  Json infos = Json::object();
  for (const size_t shape : annotated_shapes(header)) {
    write_ply(header.shapes[shape], root / "models" / ("obj_" + number(shape + 1) + ".ply"));
    infos[std::to_string(shape + 1)] = model_info(header.shapes[shape]);
  }
  write_file_atomically(root / "models" / "models_info.json", infos.dump(2) + "\n");
}

std::unique_ptr<AnnotationWriter> make_bop_writer(const TrajectoryHeader& header,
                                                  const fs::path& root, int scene) {
  return std::make_unique<BopWriter>(header,
                                     root / "train_pbr" / number(static_cast<uint64_t>(scene)));
}

}  // namespace pilesim
