#include <algorithm>
#include <cassert>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/counted.h"
#include "core/error.h"
#include "trajectory/trajectory.h"
#include "trajectory/trajectory_layout.h"

namespace pilesim {
namespace fs = std::filesystem;
namespace layout = trajectory_layout;
using nlohmann::ordered_json;

namespace {

constexpr uint64_t kNoChunk = ~uint64_t{0};

[[noreturn]] void reject(const fs::path& file, std::string found, std::string expected) {
  throw Error(ErrorKind::input,
              Problem{.file = file.string(),
                      .found = std::move(found),
                      .expected = std::move(expected),
                      .remedy = "Run the simulation again with this version of pilesim"});
}

fs::path find_store(const fs::path& directory) {
  std::error_code fault;
  for (const fs::path& store : {directory, directory / "trajectory.zarr"}) {
    if (fs::exists(store / ".zattrs", fault)) return store;
  }
  if (fs::status(directory, fault).type() == fs::file_type::none) {
    throw io_error(directory.string(), "cannot be read", fault.value());
  }
  throw Error(
      ErrorKind::input,
      Problem{.file = directory.string(),
              .found = fs::exists(directory, fault) ? "holds no trajectory" : "does not exist",
              .expected = "a trajectory.zarr, or a directory that holds one",
              .remedy = "Name the output directory of `pilesim simulate`"});
}

// The value of `key`, which must be convertible to T.
template <typename T>
T attribute(const fs::path& file, const ordered_json& object, const char* key,
            const char* expected) {
  try {
    return object.at(key).get<T>();
  } catch (const nlohmann::json::exception&) {
    const auto found = object.find(key);
    reject(file,
           std::string(key) + (found == object.end() ? " is missing" : " is " + found->dump()),
           expected);
  }
}

void check_format(const fs::path& file, const ordered_json& attributes) {
  const auto format = attributes.value("format", ordered_json());
  if (format != layout::kFormat) {
    reject(file, "format is " + format.dump(), std::string("\"") + layout::kFormat + "\"");
  }
  const auto version = attributes.value("format_version", ordered_json());
  if (version != layout::kVersion) {
    reject(file, "format_version is " + version.dump(), std::to_string(layout::kVersion));
  }
}

void check_indices(const fs::path& array, const std::vector<uint32_t>& indices, size_t end,
                   const char* of_what) {
  const auto bad =
      std::find_if(indices.begin(), indices.end(), [&](uint32_t index) { return index >= end; });
  if (bad == indices.end()) return;
  reject(array, "holds the index " + std::to_string(*bad),
         "indices below " + std::to_string(end) + ", the number of " + of_what);
}

void check_size(const fs::path& array, size_t found, size_t wanted, const std::string& of_what) {
  if (found == wanted) return;
  reject(array, "has " + counted(found, "entry", "entries"),
         std::to_string(wanted) + ", the number of " + of_what);
}

void check_share(const fs::path& array, float share) {
  if (share >= 0 && share <= 1) return;
  reject(array, "holds " + std::to_string(share), "numbers from 0 to 1");
}

void check_gloss(const fs::path& array, const std::vector<std::array<float, 2>>& rows) {
  for (const auto& row : rows) {
    for (const float share : row) check_share(array, share);
  }
}

void check_substance(const fs::path& array, const std::vector<std::array<float, 3>>& rows) {
  for (const auto& [metallic, transmission, emission] : rows) {
    check_share(array, metallic);
    check_share(array, transmission);
    if (emission >= 0 && std::isfinite(emission)) continue;
    reject(array, "holds an emission of " + std::to_string(emission), "a number of at least 0");
  }
}

void check_pattern(const fs::path& array, const std::vector<std::array<float, 2>>& rows) {
  for (const auto& [pattern, length_m] : rows) {
    if (pattern != 0 && pattern != 1 && pattern != 2 && pattern != 3) {
      reject(array, "holds the pattern " + std::to_string(pattern), "0, 1, 2 or 3");
    }
    if (length_m > 0 && std::isfinite(length_m)) continue;
    reject(array, "holds a length of " + std::to_string(length_m), "a number above 0");
  }
}

using Textures = std::vector<std::shared_ptr<const Texture>>;

Textures read_textures(const fs::path& store, const ordered_json& attributes) {
  Textures textures;
  if (!attributes.contains("textures")) return textures;
  const fs::path file = store / ".zattrs";
  const auto sizes = attribute<std::vector<ordered_json>>(file, attributes, "textures", "a list");
  for (const ordered_json& size : sizes) {
    Texture texture;
    const auto side = [&](const char* key) {
      const auto pixels = attribute<int64_t>(file, size, key, "a number of pixels");
      if (pixels < 1 || pixels > kLargestTexture) {
        reject(file, std::string("the ") + key + " of a texture is " + std::to_string(pixels),
               "1 to " + std::to_string(kLargestTexture));
      }
      return static_cast<int>(pixels);
    };
    texture.width = side("width");
    texture.height = side("height");
    const fs::path directory = layout::texture_directory(store, textures.size());
    const ZarrArray array =
        open_whole_zarr_array(directory, layout::texture(static_cast<uint64_t>(texture.width)));
    if (array.rows != static_cast<uint64_t>(texture.height)) {
      reject(directory, "has " + counted(array.rows, "row"), std::to_string(texture.height));
    }
    texture.pixels = read_zarr_values<Colour>(array, true);
    textures.push_back(std::make_shared<const Texture>(std::move(texture)));
  }
  return textures;
}

TextureMap read_texture_map(const fs::path& directory, size_t triangles, const Textures& textures) {
  const auto rows = [&](const char* name, const ZarrLayout& layout) {
    ZarrArray array = open_whole_zarr_array(directory / name, layout);
    check_size(directory / name, array.rows, triangles, "triangles");
    return array;
  };
  TextureMap map{
      .textures = textures,
      .texture = read_zarr_values<uint32_t>(rows("texture", layout::texture_of()), true),
      .corners = read_zarr_values<TextureCorners>(rows("uv", layout::texture_corners()), true)};
  check_indices(directory / "texture", map.texture, textures.size() + 1, "textures, and one");
  if (!is_sound(map, triangles)) {
    reject(directory / "uv", "holds a number that is not finite", "places in a texture");
  }
  return map;
}

// `triangles`: how many the shape has.
std::vector<RoundSurface> read_round(const fs::path& file, const ordered_json& shape,
                                     size_t triangles) {
  std::vector<RoundSurface> surfaces;
  if (!shape.contains("round")) return surfaces;
  uint64_t end = 0;
  for (const auto& item : attribute<std::vector<ordered_json>>(file, shape, "round", "a list")) {
    RoundSurface& surface = surfaces.emplace_back();
    const auto range =
        attribute<std::array<uint32_t, 2>>(file, item, "triangles", "the first, and how many");
    std::tie(surface.first_triangle, surface.triangle_count) = std::tie(range[0], range[1]);
    if (range[0] < end || uint64_t{range[0]} + range[1] > triangles) {
      reject(file, "a round surface replaces triangles that it has not",
             "ranges in ascending order within " + counted(triangles, "triangle"));
    }
    end = uint64_t{range[0]} + range[1];
    const auto p = attribute<std::array<double, 3>>(file, item, "position", "x, y, z");
    surface.pose.position = {p[0], p[1], p[2]};
    const auto q =
        attribute<std::array<double, 4>>(file, item, "orientation", "a unit quaternion w, x, y, z");
    surface.pose.orientation = {q[0], q[1], q[2], q[3]};
    for (const auto& [radius, y, bulge] : attribute<std::vector<std::array<double, 3>>>(
             file, item, "outline", "points of radius, y and bulge")) {
      if (!(radius >= 0) || !(bulge >= 0 && bulge <= 1)) {
        reject(file, "an outline has a negative radius or a bulge outside of 0 to 1",
               "points of radius, y and bulge");
      }
      surface.outline.push_back({radius, y, bulge});
    }
    if (surface.outline.size() < 2 || surface.outline.size() > kMostOutlinePoints) {
      reject(file, "an outline has " + counted(surface.outline.size(), "point"),
             "2 to " + std::to_string(kMostOutlinePoints));
    }
  }
  return surfaces;
}

TrajectoryShape read_shape(const fs::path& directory, const Textures& textures) {
  TrajectoryShape shape;
  const auto vertices = read_zarr_values<std::array<float, 3>>(
      open_whole_zarr_array(directory / "vertices", layout::vertices()), false);
  for (const auto& v : vertices) shape.vertices.emplace_back(v[0], v[1], v[2]);
  shape.triangles = read_zarr_values<std::array<uint32_t, 3>>(
      open_whole_zarr_array(directory / "triangles", layout::triangles()), false);
  std::vector<uint32_t> corners;
  for (const auto& triangle : shape.triangles) {
    corners.insert(corners.end(), triangle.begin(), triangle.end());
  }
  check_indices(directory / "triangles", corners, vertices.size(), "vertices");
  if (fs::exists(directory / "colours")) {
    const ZarrArray array = open_whole_zarr_array(directory / "colours", layout::colours());
    check_size(directory / "colours", array.rows, shape.triangles.size(), "triangles");
    shape.colours = read_zarr_values<Colour>(array, true);
  }
  if (fs::exists(directory / "texture")) {
    shape.texture_map = read_texture_map(directory, shape.triangles.size(), textures);
  }
  return shape;
}

TrajectoryHeader read_header(const fs::path& store) {
  const fs::path file = store / ".zattrs";
  const ordered_json attributes = read_zarr_json(file);
  check_format(file, attributes);

  TrajectoryHeader header;
  header.frame_rate = attribute<double>(file, attributes, "frame_rate", "frames a second");
  if (!(header.frame_rate > 0)) {
    reject(file, "frame_rate is " + std::to_string(header.frame_rate), "a number above 0");
  }
  header.seed = attribute<uint64_t>(file, attributes, "seed", "a whole number");
  header.scene_hash = attribute<std::string>(file, attributes, "scene_hash", "a hash");
  header.resolved_scene =
      attribute<ordered_json>(file, attributes, "scene", "the resolved scene").dump(2);
  header.body_name =
      attribute<std::vector<std::string>>(file, attributes, "body_name", "a list of names");
  header.materials =
      attribute<std::vector<std::string>>(file, attributes, "materials", "a list of names");
  const auto shapes = attribute<std::vector<ordered_json>>(file, attributes, "shapes", "a list");
  const Textures textures = read_textures(store, attributes);
  for (size_t i = 0; i < shapes.size(); ++i) {
    TrajectoryShape shape = read_shape(layout::shape_directory(store, i), textures);
    shape.name = attribute<std::string>(file, shapes[i], "name", "a name");
    shape.is_plane = attribute<bool>(file, shapes[i], "plane", "true or false");
    shape.type = attribute<std::string>(file, shapes[i], "type", "a type of shapes");
    shape.file = attribute<std::string>(file, shapes[i], "file", "the name of a file, or none");
    shape.scale = attribute<double>(file, shapes[i], "scale", "metres per unit of the file");
    shape.is_z_up = shapes[i].contains("up") &&  // older files lack it
                    attribute<std::string>(file, shapes[i], "up", "y or z") == "z";
    const auto c = attribute<std::array<double, 3>>(file, shapes[i], "centre_of_mass", "x, y, z");
    shape.centre_of_mass = {c[0], c[1], c[2]};
    const auto q = attribute<std::array<double, 4>>(file, shapes[i], "principal_axes",
                                                    "a unit quaternion w, x, y, z");
    shape.principal_axes = {q[0], q[1], q[2], q[3]};
    shape.round = read_round(file, shapes[i], shape.triangles.size());
    if (!shape.round.empty() && !(shape.colours.empty() && shape.texture_map.empty())) {
      reject(file, "a round surface stands beside colours of triangles", "one of the two");
    }
    header.shapes.push_back(std::move(shape));
  }

  const size_t bodies = header.body_name.size();
  const auto per_body = [&]<typename T>(const char* name, const ZarrLayout& rows,
                                        std::vector<T>& values) {
    const ZarrArray array = open_whole_zarr_array(store / name, rows);
    check_size(store / name, array.rows, bodies, "bodies");
    values = read_zarr_values<T>(array, true);
  };
  per_body("body_shape", layout::body_shape(), header.body_shape);
  per_body("body_material", layout::body_material(), header.body_material);
  per_body("body_colour", layout::body_colour(), header.body_colour);
  header.body_painted.resize(bodies);
  if (fs::exists(store / "body_painted")) {
    per_body("body_painted", layout::body_painted(), header.body_painted);
  }
  if (fs::exists(store / "body_gloss")) {
    per_body("body_gloss", layout::body_gloss(), header.body_gloss);
    check_gloss(store / "body_gloss", header.body_gloss);
  }
  if (fs::exists(store / "body_substance")) {
    per_body("body_substance", layout::body_substance(), header.body_substance);
    check_substance(store / "body_substance", header.body_substance);
  }
  if (fs::exists(store / "body_pattern")) {
    per_body("body_pattern", layout::body_pattern(), header.body_pattern);
    check_pattern(store / "body_pattern", header.body_pattern);
  }
  per_body("body_moves", layout::body_moves(), header.body_moves);
  check_indices(store / "body_shape", header.body_shape, header.shapes.size(), "shapes");
  check_indices(store / "body_material", header.body_material, header.materials.size(),
                "materials");
  return header;
}

// An array over frames, with the last used chunk.
struct FrameArray {
  ZarrArray array;
  std::vector<std::byte> bytes;
  uint64_t chunk = kNoChunk;

  const std::byte* frame(uint64_t index) {
    const uint64_t wanted = index / array.rows_per_chunk;
    if (wanted != chunk) {
      chunk = kNoChunk;  // Leave no decoded chunk if reading throws.
      read_zarr_chunk(array, wanted, bytes);
      chunk = wanted;
    }
    return bytes.data() + (index % array.rows_per_chunk) * array.layout.row_bytes();
  }
};

}  // namespace

struct TrajectoryReader::State {
  TrajectoryHeader header;
  FrameArray position, orientation, state;
  uint64_t frame_count = 0;
  std::vector<uint8_t> hidden;  // one value per body, or empty
};

TrajectoryReader::TrajectoryReader(const fs::path& directory) : state_(std::make_unique<State>()) {
  const fs::path store = find_store(directory);
  State& s = *state_;
  s.header = read_header(store);
  const size_t bodies = s.header.body_count();
  const auto over_frames = [&](const char* name, const ZarrLayout& rows) {
    return open_zarr_array(store / name, rows, layout::frames_per_chunk(bodies));
  };
  s.position.array = over_frames("position", layout::position(bodies));
  s.orientation.array = over_frames("orientation", layout::orientation(bodies));
  s.state.array = over_frames("state", layout::state(bodies));
  // After a kill during a write, the three arrays may differ by that write's frames.
  s.frame_count = std::min({s.position.array.rows, s.orientation.array.rows, s.state.array.rows});
}

TrajectoryReader::~TrajectoryReader() = default;

const TrajectoryHeader& TrajectoryReader::header() const { return state_->header; }

uint64_t TrajectoryReader::frame_count() const { return state_->frame_count; }

void TrajectoryReader::hide(std::vector<uint8_t> bodies) {
  assert(bodies.empty() || bodies.size() == header().body_count());
  state_->hidden = std::move(bodies);
}

const std::vector<uint8_t>& TrajectoryReader::hidden() const { return state_->hidden; }

void TrajectoryReader::read(uint64_t index, TrajectoryFrame& frame) {
  State& s = *state_;
  assert(index < s.frame_count);
  const size_t bodies = s.header.body_count();
  frame.position.resize(bodies);
  frame.orientation.resize(bodies);
  frame.state.resize(bodies);
  if (bodies == 0) return;
  static_assert(sizeof(Vec3) == 3 * sizeof(double));
  std::memcpy(static_cast<void*>(frame.position.data()), s.position.frame(index),
              bodies * sizeof(Vec3));
  std::memcpy(frame.state.data(), s.state.frame(index), bodies);
  for (size_t body = 0; body < s.hidden.size(); ++body) {
    if (s.hidden[body] != 0) frame.state[body] &= static_cast<uint8_t>(~kPresent);
  }
  const std::byte* wxyz = s.orientation.frame(index);
  for (size_t body = 0; body < bodies; ++body, wxyz += 4 * sizeof(float)) {
    float q[4];
    std::memcpy(q, wxyz, sizeof q);
    frame.orientation[body] = Quatf(q[0], q[1], q[2], q[3]);
  }
}

}  // namespace pilesim
