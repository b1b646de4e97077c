#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

#include "core/clock.h"
#include "core/error.h"
#include "trajectory/trajectory.h"
#include "trajectory/trajectory_layout.h"

namespace pilesim {
namespace fs = std::filesystem;
namespace layout = trajectory_layout;
using nlohmann::ordered_json;

namespace {

using Textures = std::vector<std::shared_ptr<const Texture>>;

size_t index_in(const Textures& textures, const Texture& texture) {
  const auto found = std::ranges::find_if(
      textures, [&](const std::shared_ptr<const Texture>& other) { return *other == texture; });
  return static_cast<size_t>(found - textures.begin());
}

// Textures of all shapes without repetitions: shapes of one file or picture share them.
Textures all_textures(const TrajectoryHeader& header) {
  Textures textures;
  for (const TrajectoryShape& shape : header.shapes) {
    for (const std::shared_ptr<const Texture>& texture : shape.texture_map.textures) {
      if (index_in(textures, *texture) == textures.size()) textures.push_back(texture);
    }
  }
  return textures;
}

ordered_json round_attributes(const std::vector<RoundSurface>& surfaces) {
  ordered_json list = ordered_json::array();
  for (const RoundSurface& surface : surfaces) {
    const Vec3& p = surface.pose.position;
    const Quat& q = surface.pose.orientation;
    ordered_json outline = ordered_json::array();
    for (const auto& [radius, y, bulge] : surface.outline) outline.push_back({radius, y, bulge});
    list.push_back({{"triangles", {surface.first_triangle, surface.triangle_count}},
                    {"position", {p.x(), p.y(), p.z()}},
                    {"orientation", {q.w(), q.x(), q.y(), q.z()}},
                    {"outline", std::move(outline)}});
  }
  return list;
}

ordered_json attributes(const TrajectoryHeader& header, const Textures& textures) {
  ordered_json json;
  json["format"] = layout::kFormat;
  json["format_version"] = layout::kVersion;
  // True of all pilesim's files, stated for readers that need it.
  json["handedness"] = "right";
  json["up_axis"] = "y";
  json["metres_per_unit"] = 1;
  json["frame_rate"] = header.frame_rate;
  json["seed"] = header.seed;
  json["scene_hash"] = header.scene_hash;
  json["scene"] = ordered_json::parse(header.resolved_scene);
  json["shapes"] = ordered_json::array();
  for (const TrajectoryShape& shape : header.shapes) {
    const Vec3& c = shape.centre_of_mass;
    const Quat& q = shape.principal_axes;
    json["shapes"].push_back({{"name", shape.name},
                              {"plane", shape.is_plane},
                              {"type", shape.type},
                              {"file", shape.file},
                              {"scale", shape.scale},
                              {"up", shape.is_z_up ? "z" : "y"},
                              {"centre_of_mass", {c.x(), c.y(), c.z()}},
                              {"principal_axes", {q.w(), q.x(), q.y(), q.z()}}});
    if (!shape.round.empty()) json["shapes"].back()["round"] = round_attributes(shape.round);
  }
  for (const std::shared_ptr<const Texture>& texture : textures) {
    json["textures"].push_back({{"width", texture->width}, {"height", texture->height}});
  }
  json["materials"] = header.materials;
  json["body_name"] = header.body_name;
  return json;
}

template <typename Row>
void write_whole_array(const fs::path& directory, const ZarrLayout& rows_layout,
                       const std::vector<Row>& rows, const std::vector<std::string>& dimensions,
                       const std::string& meaning) {
  const uint64_t count = rows.size() * sizeof(Row) / rows_layout.row_bytes();
  const ZarrArray array{.directory = directory,
                        .layout = rows_layout,
                        .rows_per_chunk = std::max<uint64_t>(1, count),
                        .rows = count};
  create_zarr_array(array, dimensions, meaning);
  if (!rows.empty()) write_zarr_chunk(array, 0, std::as_bytes(std::span(rows)));
}

// `textures`: those of all shapes.
void write_texture_map(const fs::path& directory, const TextureMap& map, const Textures& textures) {
  std::vector<uint32_t> number = {0};  // its own numbers, from 1
  for (const std::shared_ptr<const Texture>& texture : map.textures) {
    number.push_back(1 + static_cast<uint32_t>(index_in(textures, *texture)));
  }
  std::vector<uint32_t> texture_of;
  for (const uint32_t own : map.texture) texture_of.push_back(number[own]);
  write_whole_array(directory / "texture", layout::texture_of(), texture_of, {"triangle"},
                    "1 + index into textures, 0: none");
  write_whole_array(directory / "uv", layout::texture_corners(), map.corners,
                    {"triangle", "corner", "axis"},
                    "to the right and downward, 1: all of the texture; beyond it repeats");
}

void write_header(const fs::path& store, const TrajectoryHeader& header, const Textures& textures) {
  create_zarr_group(store);
  write_whole_array(store / "body_shape", layout::body_shape(), header.body_shape, {"body"},
                    "index into shapes");
  write_whole_array(store / "body_material", layout::body_material(), header.body_material,
                    {"body"}, "index into materials");
  write_whole_array(store / "body_colour", layout::body_colour(), header.body_colour,
                    {"body", "channel"}, "sRGB");
  if (std::ranges::find(header.body_painted, 1) != header.body_painted.end()) {
    write_whole_array(store / "body_painted", layout::body_painted(), header.body_painted, {"body"},
                      "1: drawn in the colours of its shape");
  }
  if (!header.body_gloss.empty()) {
    write_whole_array(store / "body_gloss", layout::body_gloss(), header.body_gloss,
                      {"body", "layer"}, "roughness and clear coat, 0 to 1");
  }
  if (!header.body_substance.empty()) {
    write_whole_array(store / "body_substance", layout::body_substance(), header.body_substance,
                      {"body", "share"},
                      "metallic and transmission, 0 to 1, and emission, at least 0");
  }
  if (!header.body_pattern.empty()) {
    write_whole_array(store / "body_pattern", layout::body_pattern(), header.body_pattern,
                      {"body", "value"},
                      "pattern, 0: none, 1: checker, 2: concrete, 3: planks; its length, m");
  }
  write_whole_array(store / "body_moves", layout::body_moves(), header.body_moves, {"body"},
                    "1: dynamic or kinematic, 0: fixed");
  create_zarr_group(store / "shapes");
  for (size_t i = 0; i < header.shapes.size(); ++i) {
    const fs::path directory = layout::shape_directory(store, i);
    create_zarr_group(directory);
    write_whole_array(directory / "vertices", layout::vertices(), header.shapes[i].vertices,
                      {"vertex", "axis"}, "m, body frame (origin at the centre of mass)");
    write_whole_array(directory / "triangles", layout::triangles(), header.shapes[i].triangles,
                      {"triangle", "corner"}, "vertex indices, counter-clockwise from outside");
    if (!header.shapes[i].texture_map.empty()) {
      write_texture_map(directory, header.shapes[i].texture_map, textures);
    }
    if (header.shapes[i].colours.empty()) continue;
    write_whole_array(directory / "colours", layout::colours(), header.shapes[i].colours,
                      {"triangle", "channel"}, "sRGB");
  }
  if (textures.empty()) return;
  create_zarr_group(store / "textures");
  for (size_t i = 0; i < textures.size(); ++i) {
    write_whole_array(layout::texture_directory(store, i),
                      layout::texture(static_cast<uint64_t>(textures[i]->width)),
                      textures[i]->pixels, {"row", "column", "channel"}, "sRGB");
  }
}

// Rounding step of each body's positions, m, for better compression: a power of two, at most a
// ten-millionth of the body's size; 0 for planes, which are stored exactly.
std::vector<double> position_steps(const TrajectoryHeader& header) {
  constexpr double kOfSize = 1e-7;
  std::vector<double> of_shape;
  for (const TrajectoryShape& shape : header.shapes) {
    float radius = 0;
    for (const Vec3f& vertex : shape.vertices) radius = std::max(radius, vertex.norm());
    of_shape.push_back(radius > 0 ? std::exp2(std::ilogb(kOfSize * 2 * radius)) : 0);
  }
  std::vector<double> steps;
  for (const uint32_t shape : header.body_shape) steps.push_back(of_shape[shape]);
  return steps;
}

void check(const TrajectoryHeader& header) {
  const size_t bodies = header.body_count();
  assert(header.frame_rate > 0);
  assert(header.body_name.size() == bodies && header.body_material.size() == bodies &&
         header.body_colour.size() == bodies && header.body_painted.size() <= bodies &&
         (header.body_gloss.empty() || header.body_gloss.size() == bodies) &&
         (header.body_substance.empty() || header.body_substance.size() == bodies) &&
         (header.body_pattern.empty() || header.body_pattern.size() == bodies) &&
         header.body_moves.size() == bodies);
  assert(std::all_of(header.body_shape.begin(), header.body_shape.end(),
                     [&](uint32_t shape) { return shape < header.shapes.size(); }));
  assert(std::all_of(header.body_material.begin(), header.body_material.end(),
                     [&](uint32_t material) { return material < header.materials.size(); }));
  static_cast<void>(bodies);
}

}  // namespace

struct TrajectoryWriter::State {
  size_t body_count = 0;
  std::vector<double> step_m;  // (B) see position_steps()
  // Position is written last: its length is the frame count of all three.
  ZarrArray state, orientation, position;
  // The frames of the current chunk, in its layout.
  std::vector<uint8_t> state_rows;
  std::vector<float> orientation_rows;
  std::vector<double> position_rows;
  uint64_t chunk = 0;            // index of the current chunk
  uint64_t frames_in_chunk = 0;  // in memory
  uint64_t frames_on_disk = 0;
  double longest_in_memory_s = 0;
  Stopwatch since_write;

  uint64_t frames_per_chunk() const { return position.rows_per_chunk; }

  // Opens the arrays over frames of a store, or creates them.
  State(const fs::path& directory, const TrajectoryHeader& header, double longest_s)
      : body_count(header.body_count()),
        step_m(position_steps(header)),
        longest_in_memory_s(longest_s) {
    const size_t bodies = body_count;
    const auto frames_of = [&](const char* name, const ZarrLayout& rows) {
      return ZarrArray{.directory = directory / name,
                       .layout = rows,
                       .rows_per_chunk = layout::frames_per_chunk(bodies)};
    };
    state = frames_of("state", layout::state(bodies));
    orientation = frames_of("orientation", layout::orientation(bodies));
    position = frames_of("position", layout::position(bodies));
  }

  // Keeps the first `frames` frames on disk.
  void go_on_after(uint64_t frames) {
    chunk = frames / frames_per_chunk();
    frames_in_chunk = frames % frames_per_chunk();
    frames_on_disk = frames;
    take_rows(state, frames, state_rows);
    take_rows(orientation, frames, orientation_rows);
    take_rows(position, frames, position_rows);
  }

  template <class T>
  void take_rows(ZarrArray& array, uint64_t frames, std::vector<T>& rows) const {
    const ZarrArray found = open_zarr_array(array.directory, array.layout, array.rows_per_chunk);
    if (found.rows < frames || found.rows_per_chunk != array.rows_per_chunk) {
      throw Error(ErrorKind::input,
                  Problem{.file = (array.directory / ".zarray").string(),
                          .found = "tells of " + std::to_string(found.rows) +
                                   " frames in chunks of " + std::to_string(found.rows_per_chunk),
                          .expected = std::to_string(frames) + " frames or more, in chunks of " +
                                      std::to_string(array.rows_per_chunk)});
    }
    if (frames_in_chunk > 0) {
      std::vector<std::byte> bytes;
      read_zarr_chunk(array, chunk, bytes);
      rows.resize(frames_in_chunk * array.layout.row_bytes() / sizeof(T));
      if (!rows.empty()) std::memcpy(rows.data(), bytes.data(), rows.size() * sizeof(T));
    }
    array.rows = frames;
    write_zarr_shape(array);
  }

  void write() {
    const uint64_t frames = chunk * frames_per_chunk() + frames_in_chunk;
    if (frames == frames_on_disk) return;
    write_zarr_chunk(state, chunk, std::as_bytes(std::span(state_rows)));
    write_zarr_chunk(orientation, chunk, std::as_bytes(std::span(orientation_rows)));
    write_zarr_chunk(position, chunk, std::as_bytes(std::span(position_rows)));
    for (ZarrArray* array : {&state, &orientation, &position}) {
      array->rows = frames;
      write_zarr_shape(*array);
    }
    frames_on_disk = frames;
    since_write.restart();
  }

  void start_chunk() {
    ++chunk;
    frames_in_chunk = 0;
    state_rows.clear();
    orientation_rows.clear();
    position_rows.clear();
  }
};

TrajectoryWriter::TrajectoryWriter(const fs::path& directory, const TrajectoryHeader& header,
                                   double longest_in_memory_s)
    : state_(std::make_unique<State>(directory, header, longest_in_memory_s)) {
  check(header);
  std::error_code fault;
  if (fs::exists(directory, fault)) {
    throw io_error(directory.string(), "cannot be created", EEXIST);
  }
  const fs::path parent = fs::absolute(directory).parent_path();
  fs::create_directories(parent, fault);
  if (fault) throw io_error(parent.string(), "cannot be created", fault.value());
  const Textures textures = all_textures(header);
  write_header(directory, header, textures);
  create_zarr_array(state_->state, {"frame", "body"}, kMeaningOfBodyFlags);
  create_zarr_array(state_->orientation, {"frame", "body", "wxyz"},
                    "unit quaternion (w, x, y, z), body to world");
  create_zarr_array(state_->position, {"frame", "body", "xyz"},
                    "m, centre of mass, world frame, y up");
  // Written last: a store with this file is complete.
  write_zarr_json(directory / ".zattrs", attributes(header, textures));
}

TrajectoryWriter::TrajectoryWriter(const fs::path& directory, uint64_t frames,
                                   const TrajectoryHeader& header, double longest_in_memory_s)
    : state_(std::make_unique<State>(directory, header, longest_in_memory_s)) {
  state_->go_on_after(frames);
}

TrajectoryWriter::~TrajectoryWriter() {
  try {
    close();
  } catch (const Error&) {
    // As the header says: call close() to receive errors.
  }
}

void TrajectoryWriter::append(const TrajectoryFrame& frame) {
  State& s = *state_;
  assert(frame.position.size() == s.body_count && frame.orientation.size() == s.body_count &&
         frame.state.size() == s.body_count);
  if (s.frames_in_chunk == s.frames_per_chunk()) {
    s.write();  // only has work if the last attempt failed
    s.start_chunk();
  }
  for (size_t body = 0; body < s.body_count; ++body) {
    const double step = s.step_m[body];
    for (const double value : frame.position[body]) {
      s.position_rows.push_back(step > 0 ? std::round(value / step) * step : value);
    }
  }
  for (const Quatf& q : frame.orientation) {
    const float wxyz[4] = {q.w(), q.x(), q.y(), q.z()};
    s.orientation_rows.insert(s.orientation_rows.end(), wxyz, wxyz + 4);
  }
  s.state_rows.insert(s.state_rows.end(), frame.state.begin(), frame.state.end());
  ++s.frames_in_chunk;
  if (s.frames_in_chunk == s.frames_per_chunk() ||
      s.since_write.seconds() >= s.longest_in_memory_s) {
    s.write();
  }
}

void TrajectoryWriter::flush() { state_->write(); }

uint64_t TrajectoryWriter::frames_on_disk() const { return state_->frames_on_disk; }

}  // namespace pilesim
