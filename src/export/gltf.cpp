// A single frame has one node per shape and look, instanced (EXT_mesh_gpu_instancing), or one node
// per body. Several frames have one node per body with tracks, since instances cannot move. An
// absent body has the scale 0. Data goes into one buffer after another, each a file, or all into
// one, which ends a GLB.
#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <span>
#include <utility>

#include "core/error.h"
#include "core/hash.h"
#include "export/export_text.h"
#include "export/formats.h"
#include "render/image_output.h"

namespace pilesim {
namespace fs = std::filesystem;

namespace {

// JavaScript arrays, and so most readers, are limited to 2 GiB.
constexpr uint64_t kMostBytes = (uint64_t{1} << 31) - 1;

// Parts of a buffer; from kImages on, each is a picture.
enum View : uint32_t { kVertices, kPlaces, kIndices, kTimes, kVectors, kRotations, kIds, kImages };

std::string quoted(const std::string& text) { return nlohmann::json(text).dump(); }

// A file name as a URI (RFC 3986).
std::string as_uri(const std::string& name) {
  std::string uri;
  for (const char c : name) {
    const bool plain = (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
                       std::string_view("-._~").find(c) != std::string_view::npos;
    if (plain) {
      uri += c;
      continue;
    }
    std::array<char, 4> code;
    std::snprintf(code.data(), code.size(), "%%%02X", static_cast<unsigned char>(c));
    uri += code.data();
  }
  return uri;
}

template <class Number>
std::string text_of(Number value) {
  std::string text;
  append_number(text, value);
  return text;
}

std::string list(const Vec3f& v) {
  std::string text = "[";
  append_vector(text, v);
  return text + ']';
}

std::array<float, 4> xyzw(const Quatf& q) { return {q.x(), q.y(), q.z(), q.w()}; }

std::string list(const Quatf& q) {
  std::string text = "[";
  append_vector(text, q.vec());
  text += ", ";
  append_number(text, q.w());
  return text + ']';
}

std::vector<std::array<float, 4>> all_xyzw(const std::vector<Quatf>& orientations) {
  std::vector<std::array<float, 4>> rows;
  for (const Quatf& q : orientations) rows.push_back(xyzw(q));
  return rows;
}

// Objects of one of the document's lists, as text.
class List {
 public:
  size_t add(const std::string& object) {
    if (count_ > 0) text_ += ",\n";
    text_ += object;
    return count_++;
  }
  size_t count() const { return count_; }
  const std::string& text() const { return text_; }
  // `"name": [...],`, or nothing for an empty list, as the format demands.
  std::string as(const std::string& name) const {
    return count_ == 0 ? "" : ",\n\"" + name + "\": [\n" + text_ + "]";
  }

 private:
  std::string text_;
  size_t count_ = 0;
};

// Views begin at whole words; padding follows a picture's last word.
uint64_t in_whole_words(uint64_t bytes) { return (bytes + 3) / 4 * 4; }

class Document {
 public:
  // `files` contains the document and the first buffer, and receives more; null: a single buffer.
  Document(ExportSource& source, const ExportJob& job, ExportFiles* files)
      : source_(source), job_(job), files_(files) {}

  void build(ExportForm form) {
    if (source_.frame_count() > 1) {
      add_moving_bodies();
    } else if (form == ExportForm::instances) {
      add_instances();
    } else {
      add_still_bodies();
    }
    if (source_.has_camera()) add_camera();
    if (!source_.origin().isZero()) {
      root_ = nodes_.add(
          "{\"name\": \"pile\", \"translation\": " + list(Vec3f(source_.origin().cast<float>())) +
          ", \"children\": [" + first_nodes() + "]}");
    }
    end_buffer();
  }

  std::string json() const {
    std::string text = R"({"asset": {"version": "2.0", "generator": "pilesim"},)";
    text += "\n\"extras\": {\"frame_rate\": " + text_of(source_.header().frame_rate) +
            ", \"first_frame\": " + std::to_string(source_.frame(0)) + "}";
    std::string used = has_instances_ ? "\"EXT_mesh_gpu_instancing\"" : "";
    for (const std::string& name : material_extensions_) {
      used += (used.empty() ? "" : ", ") + quoted(name);
    }
    if (!used.empty()) text += ",\n\"extensionsUsed\": [" + used + "]";
    if (has_instances_) {
      text += ",\n\"extensionsRequired\": [\"EXT_mesh_gpu_instancing\"]";
    }
    const std::string roots = root_ ? std::to_string(*root_) : first_nodes();
    text += ",\n\"scene\": 0,\n\"scenes\": [{\"name\": \"pile\"";
    if (!roots.empty()) text += ", \"nodes\": [" + roots + ']';
    text += "}]";
    text += nodes_.as("nodes") + meshes_.as("meshes") + materials_.as("materials") +
            textures_.as("textures") + images_.as("images") + cameras_.as("cameras");
    if (channels_.count() > 0) {
      text += ",\n\"animations\": [{\"name\": \"motion\"" + channels_.as("channels") +
              samplers_.as("samplers") + "}]";
    }
    text += accessors_.as("accessors") + views_.as("bufferViews") + buffers_.as("buffers");
    return text + "\n}\n";
  }

  // Size of the only buffer.
  uint64_t buffer_bytes() const {
    uint64_t bytes = 0;
    for (const std::string& data : data_) bytes += in_whole_words(data.size());
    return bytes;
  }
  void write_buffer(ExportFile& file) const {
    for (const View view : begun_) {
      const size_t size = data_[view].size();
      file.write(data_[view]);
      file.write(std::string(in_whole_words(size) - size, '\0'));
    }
  }

 private:
  // Records the location of the buffer's data, and moves it to its file if it has one.
  void end_buffer() {
    const uint64_t bytes = buffer_bytes();
    uint64_t place = 0;
    for (const View view : begun_) {
      std::string object = "{\"buffer\": " + std::to_string(buffers_.count()) +
                           ", \"byteOffset\": " + std::to_string(place) +
                           ", \"byteLength\": " + std::to_string(data_[view].size());
      if (view == kVertices) object += ", \"byteStride\": 12, \"target\": 34962";
      if (view == kPlaces) object += ", \"byteStride\": 8, \"target\": 34962";
      if (view == kIndices) object += ", \"target\": 34963";
      views_.add(object + "}");
      place += in_whole_words(data_[view].size());
    }
    if (bytes == 0) return;
    std::string buffer = "{\"byteLength\": " + std::to_string(bytes);
    if (files_ != nullptr) {
      const size_t number = buffers_.count() + 1;
      const auto name = [&] {
        return fs::path(job_.output).replace_extension('.' + std::to_string(number) + ".bin");
      };
      ExportFile& file = number == 1 ? (*files_)[1] : files_->add(name());
      write_buffer(file);
      for (std::string& data : data_) data.clear();
      begun_.clear();
      buffer += ", \"uri\": " + quoted(as_uri(file.path().filename().string()));
    }
    buffers_.add(buffer + "}");
  }

  template <class Value>
  size_t add_accessor(View view, const std::vector<Value>& values, const char* type, int component,
                      const std::string& more = {}) {
    const auto [index, offset] = append(view, std::as_bytes(std::span(values)));
    return accessors_.add("{\"bufferView\": " + std::to_string(index) +
                          ", \"byteOffset\": " + std::to_string(offset) +
                          ", \"componentType\": " + std::to_string(component) +
                          ", \"count\": " + std::to_string(values.size()) + ", \"type\": \"" +
                          type + "\"" + more + "}");
  }

  // Index of the view, and offset of the appended bytes in it.
  std::pair<size_t, size_t> append(View view, std::span<const std::byte> bytes) {
    const uint64_t most = job_.part_bytes.value_or(kMostBytes);
    const uint64_t more = in_whole_words(bytes.size());
    if (files_ != nullptr && buffer_bytes() + more > most) end_buffer();
    if (buffer_bytes() + more > kMostBytes) refuse();
    std::string& data = data_[view];
    const std::pair place(index_of(view), data.size());
    data.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    return place;
  }

  [[noreturn]] void refuse() const {
    throw Error(ErrorKind::usage,
                Problem{.file = job_.output.string(),
                        .found = "would have more than 2 GiB of poses and meshes",
                        .expected = "less, which is all that readers of glTF take",
                        .remedy = "Write .gltf, which has several .bin then, or take fewer frames "
                                  "(--every, --frames) or bodies (--only)"});
  }

  static constexpr int kFloat = 5126, kUnsigned = 5125;

  // Triangles of one texture.
  struct Part {
    const Texture* texture;  // null: none
    size_t corners;          // accessors
  };
  struct Geometry {
    size_t points = 0, normals = 0;
    std::optional<size_t> colours, places;
    std::vector<Part> parts;
  };

  size_t add_mesh(uint32_t shape, uint32_t look) {
    const auto [found, is_new] = mesh_of_.try_emplace({shape, look}, 0);
    if (!is_new) return found->second;
    const auto [geometry, is_new_shape] = geometry_of_.try_emplace(shape);
    if (is_new_shape) geometry->second = add_geometry(shape);
    const auto& [points, normals, colours, places, parts] = geometry->second;
    const bool is_painted = source_.looks()[look].is_painted;
    List primitives;
    for (const Part& part : parts) {
      const Texture* texture = is_painted ? part.texture : nullptr;
      std::string paint;
      if (texture != nullptr) {
        paint = ", \"TEXCOORD_0\": " + std::to_string(*places);
      } else if (is_painted) {
        paint = ", \"COLOR_0\": " + std::to_string(*colours);
      }
      primitives.add("{\"attributes\": {\"POSITION\": " + std::to_string(points) +
                     ", \"NORMAL\": " + std::to_string(normals) + paint +
                     "}, \"indices\": " + std::to_string(part.corners) +
                     ", \"material\": " + std::to_string(material(look, texture)) + "}");
    }
    const std::string name = source_.header().shapes[shape].name + ' ' + source_.looks()[look].name;
    found->second = meshes_.add("{\"name\": " + quoted(name) + ", \"primitives\": [" +
                                primitives.text() + "]}");
    return found->second;
  }

  static std::string bounds_of(const std::vector<Vec3f>& points) {
    Eigen::AlignedBox3f box;
    for (const Vec3f& point : points) box.extend(point);
    return ", \"min\": " + list(box.min()) + ", \"max\": " + list(box.max());
  }

  // Each point has either texture coordinates or a colour.
  Geometry add_geometry(uint32_t shape) {
    const ExportMesh& mesh = source_.shapes()[shape];
    const SplitMesh& split = mesh.split;
    Geometry geometry;
    geometry.points =
        add_accessor(kVertices, split.points, "VEC3", kFloat, bounds_of(split.points));
    geometry.normals = add_accessor(kVertices, split.normals, "VEC3", kFloat);
    if (!mesh.colours.empty()) {
      geometry.colours = add_accessor(kVertices, split.colours, "VEC3", kFloat);
    }
    if (!mesh.texture_map.empty()) {
      geometry.places = add_accessor(kPlaces, split.places, "VEC2", kFloat);
    }
    for (const TextureRun& run : split.runs) {
      const auto first = split.corners.begin() + run.first_index;
      geometry.parts.push_back(
          {run.texture == 0 ? nullptr : mesh.texture_map.textures[run.texture - 1].get(),
           add_accessor(kIndices, std::vector<uint32_t>(first, first + run.index_count), "SCALAR",
                        kUnsigned)});
    }
    return geometry;
  }

  // `texture` may be null.
  size_t material(uint32_t look, const Texture* texture) {
    const auto [found, is_new] = material_of_.try_emplace({look, texture}, 0);
    if (!is_new) return found->second;
    const ExportLook& source = source_.looks()[look];
    std::string colour;
    // Colours of vertices and textures are multiplied by it.
    for (const uint8_t value : source.is_painted ? Colour{255, 255, 255} : source.colour) {
      append_rounded(colour, static_cast<float>(linear_from_srgb(value)), 6);
      colour += ", ";
    }
    std::string picture;
    if (texture != nullptr) {
      picture =
          ", \"baseColorTexture\": {\"index\": " + std::to_string(add_texture(*texture)) + "}";
    }
    found->second = materials_.add(
        "{\"name\": " + quoted(source.name) +
        ", \"pbrMetallicRoughness\": {\"baseColorFactor\": [" + colour + "1]" + picture +
        ", \"metallicFactor\": " + text_of(source.metallic) +
        ", \"roughnessFactor\": " + text_of(source.roughness) + "}" +
        (source.emission > 0 ? ", \"emissiveFactor\": [" + colour.substr(0, colour.size() - 2) + "]"
                             : "") +
        material_extensions(source) + "}");
    return found->second;
  }

  std::string material_extensions(const ExportLook& look) {
    std::string text;
    const auto add = [&](const std::string& name, const std::string& values) {
      material_extensions_.insert(name);
      text += (text.empty() ? "" : ", ") + quoted(name) + ": {" + values + "}";
    };
    if (look.clear_coat > 0) {
      add("KHR_materials_clearcoat",
          "\"clearcoatFactor\": " + text_of(look.clear_coat) +
              ", \"clearcoatRoughnessFactor\": " + text_of(kCoatRoughness));
    }
    if (look.emission > 0) {
      add("KHR_materials_emissive_strength", "\"emissiveStrength\": " + text_of(look.emission));
    }
    if (look.transmission > 0) {
      add("KHR_materials_transmission", "\"transmissionFactor\": " + text_of(look.transmission));
    }
    return text.empty() ? "" : ", \"extensions\": {" + text + "}";
  }

  size_t add_texture(const Texture& texture) {
    const auto [found, is_new] = texture_of_.try_emplace(&texture, 0);
    if (!is_new) return found->second;
    const std::string png = png_of(texture);
    const auto view = static_cast<View>(data_.size());
    data_.emplace_back();
    const auto [index, offset] = append(view, std::as_bytes(std::span(png)));
    const size_t picture =
        images_.add("{\"bufferView\": " + std::to_string(index) + ", \"mimeType\": \"image/png\"}");
    found->second = textures_.add("{\"source\": " + std::to_string(picture) + "}");
    return found->second;
  }

  size_t add_body(const ExportBody& body, const Vec3f& position, const Quatf& orientation,
                  bool present) {
    return nodes_.add("{\"name\": " + quoted(body.name) +
                      ", \"mesh\": " + std::to_string(add_mesh(body.shape, body.look)) +
                      ", \"translation\": " + list(position) + ", \"rotation\": " +
                      list(orientation) + (present ? "" : ", \"scale\": [0, 0, 0]") +
                      ", \"extras\": {\"id\": " + std::to_string(body.id) + "}}");
  }

  void add_still_bodies() {
    TrajectoryFrame poses;
    source_.read(0, poses);
    for (size_t i = 0; i < source_.bodies().size(); ++i) {
      add_body(source_.bodies()[i], source_.place(poses, i), poses.orientation[i], true);
    }
  }

  void add_instances() {
    const std::vector<ExportBody>& bodies = source_.bodies();
    TrajectoryFrame poses;
    source_.read(0, poses);
    // Bodies of one shape and look are contiguous.
    for (size_t begin = 0, end = 0; begin < bodies.size(); begin = end) {
      std::vector<float> ids;
      std::vector<Vec3f> positions;
      std::vector<std::array<float, 4>> rotations;
      const ExportBody& first = bodies[begin];
      for (; end < bodies.size() && bodies[end].shape == first.shape &&
             bodies[end].look == first.look;
           ++end) {
        ids.push_back(static_cast<float>(bodies[end].id));
        positions.push_back(source_.place(poses, end));
        rotations.push_back(xyzw(poses.orientation[end]));
      }
      const size_t mesh = add_mesh(first.shape, first.look);
      const size_t translation = add_accessor(kVectors, positions, "VEC3", kFloat);
      const size_t rotation = add_accessor(kRotations, rotations, "VEC4", kFloat);
      const size_t id = add_accessor(kIds, ids, "SCALAR", kFloat);
      nodes_.add("{\"name\": " + quoted(source_.header().shapes[first.shape].name) +
                 ", \"mesh\": " + std::to_string(mesh) +
                 ", \"extensions\": {\"EXT_mesh_gpu_instancing\": {\"attributes\": "
                 "{\"TRANSLATION\": " +
                 std::to_string(translation) + ", \"ROTATION\": " + std::to_string(rotation) +
                 ", \"_ID\": " + std::to_string(id) + "}}}}");
      has_instances_ = true;
    }
  }

  float seconds(size_t k) const {
    return static_cast<float>(source_.time_s(k) - source_.time_s(0));
  }

  size_t add_times(const std::vector<uint32_t>& frames) {
    // Bodies that fall together share their times.
    const auto [found, is_new] =
        times_.try_emplace(content_hash(std::as_bytes(std::span(frames))), 0);
    if (is_new) {
      std::vector<float> times;
      for (const uint32_t k : frames) times.push_back(seconds(k));
      found->second = add_accessor(
          kTimes, times, "SCALAR", kFloat,
          ", \"min\": [" + text_of(times.front()) + "], \"max\": [" + text_of(times.back()) + "]");
    }
    return found->second;
  }

  void add_channel(size_t node, const char* path, size_t times, size_t values,
                   const char* interpolation = "LINEAR") {
    const size_t sampler = samplers_.add("{\"input\": " + std::to_string(times) +
                                         ", \"output\": " + std::to_string(values) +
                                         ", \"interpolation\": \"" + interpolation + "\"}");
    channels_.add("{\"sampler\": " + std::to_string(sampler) + ", \"target\": {\"node\": " +
                  std::to_string(node) + ", \"path\": \"" + path + "\"}}");
  }

  void add_pose_channels(size_t node, const std::vector<uint32_t>& frames,
                         const std::vector<Vec3f>& positions,
                         const std::vector<Quatf>& orientations) {
    const size_t times = add_times(frames);
    add_channel(node, "translation", times, add_accessor(kVectors, positions, "VEC3", kFloat));
    add_channel(node, "rotation", times,
                add_accessor(kRotations, all_xyzw(orientations), "VEC4", kFloat));
  }

  void add_moving_bodies() {
    std::vector<ExportTrack> tracks = read_tracks(source_);
    for (size_t i = 0; i < tracks.size(); ++i) {
      const ExportBody& body = source_.bodies()[i];
      // Move it: memory holds the motion once, here or in a buffer.
      const ExportTrack track = std::move(tracks[i]);
      const size_t node =
          add_body(body, track.position[0], track.orientation[0], body.starts_present);
      if (track.key.size() > 1) {
        add_pose_channels(node, track.key, track.position, track.orientation);
      }
      if (track.toggles.empty()) continue;
      std::vector<uint32_t> frames = {0};
      frames.insert(frames.end(), track.toggles.begin(), track.toggles.end());
      std::vector<Vec3f> scales;
      for (size_t t = 0; t < frames.size(); ++t) {
        scales.emplace_back(Vec3f::Constant((t % 2 == 0) == body.starts_present ? 1.0f : 0.0f));
      }
      add_channel(node, "scale", add_times(frames), add_accessor(kVectors, scales, "VEC3", kFloat),
                  "STEP");
    }
  }

  void add_camera() {
    const CameraKey first = source_.camera(0);
    cameras_.add(
        "{\"type\": \"perspective\", \"perspective\": {\"aspectRatio\": " + text_of(job_.aspect) +
        ", \"yfov\": " + text_of(first.field_of_view) + ", \"znear\": 0.01}}");
    std::vector<uint32_t> frames;
    std::vector<Vec3f> positions;
    std::vector<Quatf> orientations;
    const size_t count = source_.camera_moves() ? source_.frame_count() : 1;
    for (uint32_t k = 0; k < count; ++k) {
      const CameraKey key = source_.camera(k);
      Quatf q = camera_orientation(key).cast<float>();
      if (k > 0 && q.dot(orientations.back()) < 0) q.coeffs() = -q.coeffs();
      frames.push_back(k);
      positions.push_back(source_.from_origin(key.position));
      orientations.push_back(q);
    }
    const size_t node =
        nodes_.add("{\"name\": \"camera\", \"camera\": 0, \"translation\": " + list(positions[0]) +
                   ", \"rotation\": " + list(orientations[0]) + "}");
    if (count > 1) add_pose_channels(node, frames, positions, orientations);
  }

  // All nodes so far.
  std::string first_nodes() const {
    std::string nodes;
    for (size_t i = 0; i < nodes_.count(); ++i) nodes += (i > 0 ? "," : "") + std::to_string(i);
    return nodes;
  }

  // Its index among the views with content, over all buffers.
  size_t index_of(View view) {
    const auto found = std::ranges::find(begun_, view);
    const auto place = views_.count() + static_cast<size_t>(found - begun_.begin());
    if (found == begun_.end()) begun_.push_back(view);
    return place;
  }

  ExportSource& source_;
  const ExportJob& job_;
  ExportFiles* files_;
  // Data of the current buffer.
  std::vector<std::string> data_ = std::vector<std::string>(kImages);
  std::vector<View> begun_;  // those with content
  List nodes_, meshes_, materials_, textures_, images_, cameras_, accessors_, samplers_, channels_,
      views_, buffers_;
  std::map<std::pair<uint32_t, uint32_t>, size_t> mesh_of_;
  std::map<uint32_t, Geometry> geometry_of_;
  std::map<std::pair<uint32_t, const Texture*>, size_t> material_of_;
  std::map<const Texture*, size_t> texture_of_;
  std::map<std::string, size_t> times_;
  std::optional<size_t> root_;  // parent of all others at the source's origin, if that is not 0
  bool has_instances_ = false;
  std::set<std::string> material_extensions_;
};

std::string word(uint64_t value) {
  const auto bits = static_cast<uint32_t>(value);
  return {reinterpret_cast<const char*>(&bits), sizeof bits};
}

}  // namespace

void write_gltf(ExportSource& source, const ExportJob& job, ExportForm form, ExportFiles& files) {
  Document document(source, job, &files);
  document.build(form);
  files[0].write(document.json());
}

void write_glb(ExportSource& source, const ExportJob& job, ExportForm form, ExportFile& file) {
  Document document(source, job, nullptr);
  document.build(form);
  std::string json = document.json();
  json.append((4 - json.size() % 4) % 4, ' ');
  const uint64_t bytes = document.buffer_bytes();  // a multiple of the word size
  // An empty chunk must be left out.
  const std::string chunk = bytes == 0 ? "" : word(bytes) + std::string("BIN\0", 4);
  file.write("glTF" + word(2) + word(12 + 8 + json.size() + chunk.size() + bytes));
  file.write(word(json.size()) + "JSON" + json + chunk);
  document.write_buffer(file);
}

}  // namespace pilesim
