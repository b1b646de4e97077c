// A zip archive (PKWARE's APPNOTE) of arrays in their memory layout, uncompressed, with 64-bit
// sizes.
#include <zlib.h>

#include <array>
#include <cstring>
#include <nlohmann/json.hpp>

#include "export/export_text.h"
#include "export/formats.h"

namespace pilesim {
namespace {

static_assert(std::endian::native == std::endian::little);

template <class Number>
void append_bytes(std::string& bytes, Number value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

// Header of an array: version 1.0, padded so that the numbers start at a multiple of 64.
std::string npy_header(const std::string& type, const std::string& shape) {
  std::string text =
      "{'descr': '" + type + "', 'fortran_order': False, 'shape': (" + shape + "), }";
  constexpr size_t kBefore = 10, kAlignment = 64;
  text.append(kAlignment - 1 - (kBefore + text.size()) % kAlignment, ' ');
  text += '\n';
  std::string header = std::string("\x93NUMPY\x01\x00", 8);
  append_bytes(header, static_cast<uint16_t>(text.size()));
  return header + text;
}

class Archive {
 public:
  explicit Archive(ExportFile& file) : file_(file) {}

  void begin(const std::string& name, const std::string& type, const std::string& shape) {
    entry_ = {.name = name + ".npy", .place = file_.size()};
    file_.write(local_header(entry_));
    start_ = file_.size();
    add(npy_header(type, shape));
  }
  void add(std::string_view bytes) {
    // zlib counts in 32 bits.
    for (std::string_view left = bytes; !left.empty();) {
      const std::string_view part = left.substr(0, size_t{1} << 30);
      entry_.crc = static_cast<uint32_t>(crc32(
          entry_.crc, reinterpret_cast<const Bytef*>(part.data()), static_cast<uInt>(part.size())));
      left.remove_prefix(part.size());
    }
    file_.write(bytes);
  }
  template <class Value>
  void add_values(const std::vector<Value>& values) {
    add({reinterpret_cast<const char*>(values.data()), values.size() * sizeof(Value)});
  }
  void end() {
    entry_.bytes = file_.size() - start_;
    file_.patch(entry_.place, local_header(entry_));
    entries_.push_back(entry_);
  }
  template <class Value>
  void array(const std::string& name, const std::string& type, const std::string& shape,
             const std::vector<Value>& values) {
    begin(name, type, shape);
    add_values(values);
    end();
  }

  void finish() {
    const uint64_t place = file_.size();
    for (const Entry& entry : entries_) file_.write(central_header(entry));
    const uint64_t bytes = file_.size() - place;
    std::string end("PK\x06\x06", 4);  // zip64 end of central directory
    append_bytes(end, uint64_t{44});
    append_bytes(end, kVersion);
    append_bytes(end, kVersion);
    append_bytes(end, uint32_t{0});
    append_bytes(end, uint32_t{0});
    append_bytes(end, uint64_t{entries_.size()});
    append_bytes(end, uint64_t{entries_.size()});
    append_bytes(end, bytes);
    append_bytes(end, place);
    const uint64_t end_place = file_.size();
    end += std::string("PK\x06\x07", 4);  // its location
    append_bytes(end, uint32_t{0});
    append_bytes(end, end_place);
    append_bytes(end, uint32_t{1});
    end += std::string("PK\x05\x06", 4);  // the end record; its numbers are in the one above
    append_bytes(end, uint32_t{0});
    append_bytes(end, uint16_t{0xffff});
    append_bytes(end, uint16_t{0xffff});
    append_bytes(end, ~uint32_t{0});
    append_bytes(end, ~uint32_t{0});
    append_bytes(end, uint16_t{0});
    file_.write(end);
  }

 private:
  static constexpr uint16_t kVersion = 45;  // needed for zip64
  // 1 January 1980, so that the bytes do not depend on the time.
  static constexpr uint32_t kDate = 0x00210000;

  struct Entry {
    std::string name;
    uint64_t place = 0, bytes = 0;
    uint32_t crc = 0;
  };

  // Common part of both headers: flags (names in UTF-8), stored, date, checksum, and sizes, which
  // refer to the extra field.
  static void append_common(std::string& header, const Entry& entry, uint16_t extra_bytes) {
    append_bytes(header, kVersion);
    append_bytes(header, uint16_t{0x800});
    append_bytes(header, uint16_t{0});
    append_bytes(header, kDate);
    append_bytes(header, entry.crc);
    append_bytes(header, ~uint32_t{0});
    append_bytes(header, ~uint32_t{0});
    append_bytes(header, static_cast<uint16_t>(entry.name.size()));
    append_bytes(header, extra_bytes);
  }
  static std::string local_header(const Entry& entry) {
    std::string header("PK\x03\x04", 4);
    append_common(header, entry, 20);
    header += entry.name;
    append_bytes(header, uint16_t{1});
    append_bytes(header, uint16_t{16});
    append_bytes(header, entry.bytes);
    append_bytes(header, entry.bytes);
    return header;
  }
  static std::string central_header(const Entry& entry) {
    std::string header("PK\x01\x02", 4);
    append_bytes(header, kVersion);
    append_common(header, entry, 28);
    append_bytes(header, uint16_t{0});   // comment
    append_bytes(header, uint16_t{0});   // disk
    append_bytes(header, uint16_t{0});   // internal attributes
    append_bytes(header, uint32_t{0});   // external attributes
    append_bytes(header, ~uint32_t{0});  // offset: in the extra field
    header += entry.name;
    append_bytes(header, uint16_t{1});
    append_bytes(header, uint16_t{24});
    append_bytes(header, entry.bytes);
    append_bytes(header, entry.bytes);
    append_bytes(header, entry.place);
    return header;
  }

  ExportFile& file_;
  std::vector<Entry> entries_;
  Entry entry_;
  uint64_t start_ = 0;
};

// Text that numpy reads without pickling: an array of bytes, JSON in UTF-8.
void add_json(Archive& archive, const std::string& name, const nlohmann::ordered_json& json) {
  const std::string text = json.dump();
  archive.begin(name, "|u1", std::to_string(text.size()) + ",");
  archive.add(text);
  archive.end();
}

std::vector<std::array<float, 4>> wxyz(const std::vector<Quatf>& orientations) {
  std::vector<std::array<float, 4>> rows;
  rows.reserve(orientations.size());
  for (const Quatf& q : orientations) rows.push_back({q.w(), q.x(), q.y(), q.z()});
  return rows;
}

}  // namespace

void write_npz(ExportSource& source, const ExportJob& job, ExportFile& file) {
  Archive archive(file);
  const std::vector<ExportBody>& bodies = source.bodies();
  const std::string frames = std::to_string(source.frame_count());
  const std::string count = std::to_string(bodies.size());

  std::vector<int64_t> frame;
  std::vector<double> time_s;
  for (size_t k = 0; k < source.frame_count(); ++k) {
    frame.push_back(static_cast<int64_t>(source.frame(k)));
    time_s.push_back(source.time_s(k));
  }
  archive.array("frame", "<i8", frames + ",", frame);
  archive.array("time_s", "<f8", frames + ",", time_s);

  std::vector<uint32_t> id, shape, look;
  std::vector<uint8_t> moves;
  nlohmann::ordered_json about;
  about["frame_rate"] = source.header().frame_rate;
  about["handedness"] = "right";
  about["up_axis"] = "y";
  about["metres_per_unit"] = 1;
  about["aspect"] = job.aspect;
  about["origin_m"] = {source.origin().x(), source.origin().y(), source.origin().z()};
  for (const ExportBody& body : bodies) {
    id.push_back(body.id);
    shape.push_back(body.shape);
    look.push_back(body.look);
    moves.push_back(body.last_change > 0 ? 1 : 0);
    about["body_name"].push_back(body.name);
  }
  for (const TrajectoryShape& s : source.header().shapes) {
    about["shape_name"].push_back(s.name);
    about["shape_plane"].push_back(s.is_plane);
  }
  for (const ExportLook& l : source.looks()) {
    about["look_name"].push_back(l.name);
    about["look_colour"].push_back(l.colour);
    about["look_painted"].push_back(l.is_painted);
    about["look_roughness"].push_back(l.roughness);
    about["look_clear_coat"].push_back(l.clear_coat);
    about["look_metallic"].push_back(l.metallic);
    about["look_transmission"].push_back(l.transmission);
    about["look_emission"].push_back(l.emission);
  }
  add_json(archive, "about_json", about);
  archive.array("id", "<u4", count + ",", id);
  archive.array("shape", "<u4", count + ",", shape);
  archive.array("look", "<u4", count + ",", look);
  archive.array("moves", "|u1", count + ",", moves);

  TrajectoryFrame poses;
  const auto over_frames = [&](const char* name, const char* type, const std::string& row,
                               const auto& add) {
    archive.begin(name, type, frames + ", " + count + row);
    for (size_t k = 0; k < source.frame_count(); ++k) {
      source.read(k, poses);
      add();
    }
    archive.end();
  };
  over_frames("position", "<f8", ", 3", [&] { archive.add_values(poses.position); });
  over_frames("orientation", "<f4", ", 4", [&] { archive.add_values(wxyz(poses.orientation)); });
  over_frames("state", "|u1", "", [&] { archive.add_values(poses.state); });

  NumberedTextures textures;
  for (size_t i = 0; i < source.shapes().size(); ++i) {
    const ExportMesh& mesh = source.shapes()[i];
    const std::string prefix = "shape_" + std::to_string(i);
    archive.array(prefix + "_vertices", "<f4", std::to_string(mesh.points.size()) + ", 3",
                  mesh.points);
    archive.array(prefix + "_triangles", "<u4", std::to_string(mesh.corners.size() / 3) + ", 3",
                  mesh.corners);
    if (mesh.colours.empty()) continue;
    archive.array(prefix + "_colours", "|u1", std::to_string(mesh.colours.size()) + ", 3",
                  mesh.colours);
    if (mesh.texture_map.empty()) continue;
    archive.array(prefix + "_texture", "<u4", std::to_string(mesh.texture_map.texture.size()) + ",",
                  textures.numbers(mesh.texture_map));
    archive.array(prefix + "_uv", "<f4", std::to_string(mesh.texture_map.corners.size()) + ", 3, 2",
                  mesh.texture_map.corners);
  }
  for (size_t k = 0; k < textures.all().size(); ++k) {
    const Texture& texture = *textures.all()[k];
    archive.array("texture_" + std::to_string(k), "|u1",
                  std::to_string(texture.height) + ", " + std::to_string(texture.width) + ", 3",
                  texture.pixels);
  }
  if (source.has_camera()) {
    // One row if the camera does not move.
    const size_t rows = source.camera_moves() ? source.frame_count() : 1;
    std::vector<std::array<double, 8>> camera;
    for (size_t k = 0; k < rows; ++k) {
      const CameraKey key = source.camera(k);
      const Quat q = camera_orientation(key);
      const Vec3& p = key.position;
      camera.push_back({p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z(), key.field_of_view});
    }
    archive.array("camera", "<f8", std::to_string(rows) + ", 8", camera);
  }
  archive.finish();
}

}  // namespace pilesim
