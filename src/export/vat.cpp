// A rigid vertex-animation texture: two pictures with the poses, and one mesh of all bodies
// whose vertices refer to their body. In frame k, a vertex at p of body b is at
//
//     q(p) + t,   t and q the texels of b in frame k,
//
// relative to the origin of the document.
//
// A frame takes `rows` rows of `columns` texels, row by row: that of body b is at column b %
// columns of row k * rows + b / columns.
#include "export/vat.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>

#include "core/body_flags.h"
#include "core/error.h"
#include "export/export_text.h"
#include "render/exr.h"

namespace pilesim {
namespace {

using Json = nlohmann::ordered_json;

// Longest side of a texture on graphics cards of the last ten years.
constexpr size_t kLongestSide = 8192;
// JavaScript arrays, and so most readers, are limited to 2 GiB.
constexpr uint64_t kMostBytes = (uint64_t{1} << 31) - 1;

[[noreturn]] void refuse(const ExportJob& job, const std::string& found,
                         const std::string& expected, const std::string& remedy) {
  throw Error(
      ErrorKind::usage,
      Problem{.file = job.output.string(), .found = found, .expected = expected, .remedy = remedy});
}

// One array of vertex attributes, or the indices.
struct Part {
  const char* name;
  const char* type;
  int component;
  uint64_t bytes_each;
};

constexpr int kFloat = 5126, kUnsigned = 5125, kShort = 5123;
constexpr std::array<Part, 5> kParts = {{{"POSITION", "VEC3", kFloat, 12},
                                         {"NORMAL", "VEC3", kFloat, 12},
                                         {"TEXCOORD_0", "VEC2", kFloat, 8},
                                         {"_BODY", "SCALAR", kFloat, 4},
                                         {"COLOR_0", "VEC4", kShort, 8}}};

class MergedMesh {
 public:
  MergedMesh(const ExportSource& source, const VatLayout& layout)
      : source_(source), layout_(layout) {
    for (const ExportBody& body : source.bodies()) {
      const ExportMesh& mesh = source.shapes()[body.shape];
      vertices_ += mesh.split.points.size();
      indices_ += mesh.split.corners.size();
      for (const Vec3f& point : mesh.split.points) box_.extend(point);
    }
  }

  uint64_t vertices() const { return vertices_; }
  uint64_t bytes() const {
    uint64_t sum = indices_ * sizeof(uint32_t);
    for (const Part& part : kParts) sum += vertices_ * part.bytes_each;
    return sum;
  }

  // The document of the GLB.
  std::string json() const {
    Json json;
    json["asset"] = {{"version", "2.0"}, {"generator", "pilesim"}};
    json["scene"] = 0;
    json["scenes"] = {{{"name", "pile"}, {"nodes", {0}}}};
    json["nodes"] = {{{"name", "pile"}, {"mesh", 0}}};
    json["materials"] = {
        {{"name", "pile"},
         {"pbrMetallicRoughness", {{"metallicFactor", 0}, {"roughnessFactor", mean_roughness()}}}}};
    Json attributes;
    uint64_t place = 0;
    const auto add = [&](uint64_t count, uint64_t bytes, int target, Json accessor) {
      accessor["bufferView"] = json["bufferViews"].size();
      accessor["count"] = count;
      json["bufferViews"].push_back(
          {{"buffer", 0}, {"byteOffset", place}, {"byteLength", bytes}, {"target", target}});
      json["accessors"].push_back(accessor);
      place += bytes;
      return json["accessors"].size() - 1;
    };
    for (const Part& part : kParts) {
      Json accessor = {{"componentType", part.component}, {"type", part.type}};
      if (&part == &kParts[0]) {
        accessor["min"] = {box_.min().x(), box_.min().y(), box_.min().z()};
        accessor["max"] = {box_.max().x(), box_.max().y(), box_.max().z()};
      }
      if (part.component == kShort) accessor["normalized"] = true;
      attributes[part.name] = add(vertices_, vertices_ * part.bytes_each, 34962, accessor);
    }
    const size_t corners = add(indices_, indices_ * sizeof(uint32_t), 34963,
                               {{"componentType", kUnsigned}, {"type", "SCALAR"}});
    json["meshes"] = {
        {{"name", "pile"},
         {"primitives", {{{"attributes", attributes}, {"indices", corners}, {"material", 0}}}}}};
    json["buffers"] = {{{"byteLength", place}}};
    return json.dump();
  }

  void write(ExportFile& file) const {
    const auto of_each = [&](const auto& values_of) {
      for (size_t b = 0; b < source_.bodies().size(); ++b) {
        const ExportMesh& mesh = source_.shapes()[source_.bodies()[b].shape];
        const auto values = values_of(b, mesh);
        file.write_values(std::span(std::as_const(values)));
      }
    };
    of_each([](size_t, const ExportMesh& mesh) { return mesh.split.points; });
    of_each([](size_t, const ExportMesh& mesh) { return mesh.split.normals; });
    of_each([&](size_t b, const ExportMesh& mesh) {
      const size_t column = b % layout_.columns, row = b / layout_.columns;
      const std::array<float, 2> texel = {
          (static_cast<float>(column) + 0.5f) / static_cast<float>(layout_.columns),
          (static_cast<float>(row) + 0.5f) / static_cast<float>(layout_.height)};
      return std::vector(mesh.split.points.size(), texel);
    });
    of_each([](size_t b, const ExportMesh& mesh) {
      return std::vector(mesh.split.points.size(), static_cast<float>(b));
    });
    of_each([&](size_t b, const ExportMesh& mesh) {
      return std::vector(mesh.split.points.size(), colour(b));
    });
    uint32_t first = 0;
    of_each([&](size_t, const ExportMesh& mesh) {
      std::vector<uint32_t> corners = mesh.split.corners;
      for (uint32_t& corner : corners) corner += first;
      first += static_cast<uint32_t>(mesh.split.points.size());
      return corners;
    });
  }

 private:
  // All bodies share one material.
  float mean_roughness() const {
    double sum = 0;
    for (const ExportBody& body : source_.bodies()) sum += source_.looks()[body.look].roughness;
    const size_t count = std::max<size_t>(source_.bodies().size(), 1);
    return static_cast<float>(std::round(1000 * sum / static_cast<double>(count)) / 1000);
  }
  // Linear light, scaled to 65535.
  std::array<uint16_t, 4> colour(size_t body) const {
    const Colour& srgb = source_.looks()[source_.bodies()[body].look].colour;
    std::array<uint16_t, 4> linear = {0, 0, 0, 65535};
    for (size_t c = 0; c < 3; ++c) {
      linear[c] = static_cast<uint16_t>(std::lround(65535 * linear_from_srgb(srgb[c])));
    }
    return linear;
  }

  const ExportSource& source_;
  const VatLayout& layout_;
  uint64_t vertices_ = 0, indices_ = 0;
  Eigen::AlignedBox3f box_;
};

std::string word(uint64_t value) {
  const auto bits = static_cast<uint32_t>(value);
  return {reinterpret_cast<const char*>(&bits), sizeof bits};
}

void write_mesh(const MergedMesh& mesh, const ExportJob& job, ExportFile& file) {
  const uint64_t bytes = mesh.bytes();
  if (bytes > kMostBytes || mesh.vertices() > std::numeric_limits<uint32_t>::max()) {
    refuse(job,
           "would have a mesh of " + std::to_string(mesh.vertices()) + " vertices, " +
               std::to_string(bytes >> 20) + " MiB",
           "less than 2 GiB, which is all that readers of glTF take",
           "Take fewer bodies (--only), or simulate simpler meshes");
  }
  std::string json = mesh.json();
  json.append((4 - json.size() % 4) % 4, ' ');
  file.write("glTF" + word(2) + word(12 + 8 + json.size() + 8 + bytes));
  file.write(word(json.size()) + "JSON" + json + word(bytes) + std::string("BIN\0", 4));
  mesh.write(file);
}

// Writes texel(index of the pose) of all frames as a picture with the channels R, G, B and A.
template <class Texel>
void write_texture(ExportSource& source, const VatLayout& layout, const ExportJob& job,
                   ExportFile& file, const Texel& texel) {
  std::vector<std::array<float, 4>> texels(layout.columns * layout.height);
  TrajectoryFrame poses;
  for (size_t k = 0; k < source.frame_count(); ++k) {
    source.read(k, poses);
    std::array<float, 4>* row = &texels[k * layout.rows * layout.columns];
    for (size_t b = 0; b < source.bodies().size(); ++b) row[b] = texel(poses, b);
  }
  const float* first = texels.front().data();
  file.write(
      exr_bytes(job.output, static_cast<int>(layout.columns), static_cast<int>(layout.height),
                {{"R", first, 4}, {"G", first + 1, 4}, {"B", first + 2, 4}, {"A", first + 3, 4}}));
}

Json about(const ExportSource& source, const VatLayout& layout,
           const std::vector<std::string>& names) {
  const Eigen::AlignedBox3f& box = source.bounds();
  Json json;
  json["format"] = "pilesim vertex animation";
  json["version"] = 1;
  json["mesh"] = names[0];
  json["positions"] = names[1];
  json["rotations"] = names[2];
  json["frame_rate"] = source.header().frame_rate * layout.frames_per_step;
  json["frames"] = source.frame_count();
  json["first_frame"] = source.frame(0);
  json["width"] = layout.columns;
  json["height"] = layout.height;
  json["rows_of_a_frame"] = layout.rows;
  json["bounds_m"] = {{box.min().x(), box.min().y(), box.min().z()},
                      {box.max().x(), box.max().y(), box.max().z()}};
  const Vec3& origin = source.origin();
  json["origin_m"] = {origin.x(), origin.y(), origin.z()};
  json["up_axis"] = "y";
  json["handedness"] = "right";
  json["metres_per_unit"] = 1;
  for (const ExportBody& body : source.bodies()) {
    json["body_name"].push_back(body.name);
    json["body_id"].push_back(body.id);
  }
  return json;
}

}  // namespace

VatLayout vat_layout(size_t bodies, size_t frames) {
  VatLayout layout;
  layout.rows = std::max<size_t>((bodies + kLongestSide - 1) / kLongestSide, 1);
  layout.columns = std::max<size_t>((bodies + layout.rows - 1) / layout.rows, 1);
  layout.height = layout.rows * frames;
  return layout;
}

void write_vat(ExportSource& source, const ExportJob& job, const VatFiles& files) {
  VatLayout layout = vat_layout(source.bodies().size(), source.frame_count());
  if (layout.height > kLongestSide) {
    refuse(job, "would have pictures " + std::to_string(layout.height) + " pixels high",
           "at most " + std::to_string(kLongestSide) + ", which graphics cards take",
           "Take fewer frames (--every, --frames) or bodies (--only)");
  }
  if (source.frame_count() > 1) {
    layout.frames_per_step = 1.0 / static_cast<double>(source.frame(1) - source.frame(0));
  }
  write_mesh(MergedMesh(source, layout), job, files.mesh);
  write_texture(source, layout, job, files.positions, [&](const TrajectoryFrame& poses, size_t b) {
    const Vec3f p = source.place(poses, b);
    const bool present = (poses.state[b] & kPresent) != 0;
    return std::array{p.x(), p.y(), p.z(), present ? 1.0f : 0.0f};
  });
  write_texture(source, layout, job, files.rotations, [](const TrajectoryFrame& poses, size_t b) {
    const Quatf& q = poses.orientation[b];
    return std::array{q.x(), q.y(), q.z(), q.w()};
  });
  files.about.write(about(source, layout, files.names).dump(1) + '\n');
}

}  // namespace pilesim
