#include "view/view_data.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/body_flags.h"
#include "render/draw_list.h"
#include "render/image_output.h"

namespace pilesim {
namespace {

static_assert(std::endian::native == std::endian::little);

// Most keys of a page: half a minute of 10,000 moving bodies.
constexpr size_t kMostKeys = 9'000'000;
// Twice the triangles that machines without a graphics card draw 30 times per second.
constexpr size_t kMostTriangles = 1'200'000;
constexpr size_t kMoments = 240;           // points of the curve of moving bodies
constexpr float kStepOfRadius = 5e-4f;     // finer than visible
constexpr size_t kOfFast = 98;             // per cent of speeds below the scale's end
constexpr size_t kMostMeasured = 200'000;  // bodies times frames: under a minute
constexpr int kLargestPicture = 1024;      // texels per side, so that a page can be sent by mail

bool is_present(uint8_t state) { return (state & kPresent) != 0; }

bool moves(const ExportSource& source, size_t body) {
  return source.header().body_moves[source.bodies()[body].id] != 0;
}

// Takes every n-th moving body by number, as a sample of the whole pile.
void choose_bodies(const ExportSource& source, uint64_t most, ViewData& data) {
  std::vector<uint32_t> moving;
  for (uint32_t i = 0; i < source.bodies().size(); ++i) {
    (moves(source, i) ? moving : data.shown).push_back(i);
  }
  std::ranges::sort(moving, {}, [&](uint32_t i) { return source.bodies()[i].id; });
  data.all_moving_bodies = moving.size();
  data.moving_bodies = std::min<size_t>(moving.size(), most);
  for (size_t i = 0; i < data.moving_bodies; ++i) {
    data.shown.push_back(moving[i * moving.size() / data.moving_bodies]);
  }
  std::ranges::sort(data.shown);
}

void choose_frames(const ExportSource& source, ViewData& data) {
  size_t keys = 0;
  for (const uint32_t i : data.shown) {
    const ExportBody& body = source.bodies()[i];
    keys += body.last_change - body.first_change;
  }
  data.every = keys / kMostKeys + 1;
  data.frames = (source.frame_count() - 1) / data.every + 1;
}

// Finds the positions of each body over time, and of the pile.
void find_places(ExportSource& source, ViewData& data) {
  TrajectoryFrame poses;
  std::array<std::vector<float>, 3> places;
  const size_t apart = data.frames / 40 + 1;
  for (size_t k = 0; k < data.frames; ++k) {
    source.read(k * data.every, poses);
    for (size_t i = 0; i < data.shown.size(); ++i) {
      const uint32_t body = data.shown[i];
      const Vec3f place = source.place(poses, body);
      ViewTrack& track = data.tracks[i];
      track.low = k == 0 ? place : track.low.cwiseMin(place).eval();
      track.high = k == 0 ? place : track.high.cwiseMax(place).eval();
      if (moves(source, body)) {
        data.states = static_cast<uint8_t>(data.states | poses.state[body]);
      }
      if (!moves(source, body) || !is_present(poses.state[body]) || (k % apart != 0)) continue;
      for (int axis = 0; axis < 3; ++axis) places[axis].push_back(place[axis]);
    }
  }
  float largest = 0;
  for (size_t i = 0; i < data.shown.size(); ++i) {
    const float radius = source.shapes()[source.bodies()[data.shown[i]].shape].radius_m;
    ViewTrack& track = data.tracks[i];
    track.step_m = std::max((track.high - track.low).maxCoeff() / 65534, kStepOfRadius * radius);
    if (!(track.step_m > 0)) track.step_m = 1e-6f;
    if (moves(source, data.shown[i])) largest = std::max(largest, radius);
  }
  if (places[0].empty()) return;
  Vec3f low, high;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<float>& all = places[axis];
    std::ranges::sort(all);
    low[axis] = all[all.size() / 50];
    high[axis] = all[all.size() - 1 - all.size() / 50];
  }
  data.centre = 0.5f * (low + high);
  data.radius_m = 0.5f * (high - low).norm() + largest;
}

void widen_to_fixed_bodies(const ExportSource& source, ViewData& data) {
  const float pile = data.radius_m;
  for (size_t i = 0; i < data.shown.size(); ++i) {
    const ExportBody& body = source.bodies()[data.shown[i]];
    if (moves(source, data.shown[i]) || source.header().shapes[body.shape].is_plane) continue;
    const float reach =
        (data.tracks[i].low - data.centre).norm() + source.shapes()[body.shape].radius_m;
    if (reach < 2.5f * pile) data.radius_m = std::max(data.radius_m, reach);
  }
}

ViewKey key_of(const ViewTrack& track, uint32_t frame, const Vec3f& place, const Quatf& turn) {
  ViewKey key{.frame = frame};
  for (size_t axis = 0; axis < 3; ++axis) {
    const float steps = (place[axis] - track.low[axis]) / track.step_m;
    key.value[axis] = static_cast<uint16_t>(std::clamp(std::lround(steps), 0L, 65535L));
  }
  const Eigen::Vector4f& q = turn.coeffs();
  for (int c = 0; c < 4; ++c) {
    key.value[3 + c] = static_cast<uint16_t>(static_cast<int16_t>(std::lround(q[c] * kTurnUnits)));
  }
  return key;
}

void append_pose(ViewTrack& track, const ViewKey& key) {
  if (!track.keys.empty()) {
    const ViewKey last = track.keys.back();
    if (last.value == key.value) return;
    if (last.frame + 1 != key.frame) track.keys.push_back({key.frame - 1, last.value});
  }
  track.keys.push_back(key);
}

void read_keys(ExportSource& source, ViewData& data) {
  TrajectoryFrame poses;
  for (size_t k = 0; k < data.frames; ++k) {
    source.read(k * data.every, poses);
    const auto frame = static_cast<uint32_t>(k);
    for (size_t i = 0; i < data.shown.size(); ++i) {
      const uint32_t body = data.shown[i];
      ViewTrack& track = data.tracks[i];
      append_pose(track, key_of(track, frame, source.place(poses, body), poses.orientation[body]));
      if (track.states.empty() || track.states.back().second != poses.state[body]) {
        track.states.emplace_back(frame, poses.state[body]);
      }
    }
  }
}

void measure_motion(const ExportSource& source, ViewData& data) {
  std::vector<uint32_t> moving(data.frames);
  std::vector<float> speeds;
  const double rate =
      source.header().frame_rate *
      (source.frame_count() > 1
           ? static_cast<double>(data.frames - 1) /
                 (static_cast<double>(source.frame(data.every * (data.frames - 1))) -
                  static_cast<double>(source.frame(0)) + 1e-9)
           : 1);
  for (const ViewTrack& track : data.tracks) {
    for (size_t k = 1; k < track.keys.size(); ++k) {
      const ViewKey &a = track.keys[k - 1], &b = track.keys[k];
      if (a.value == b.value) continue;
      ++moving[b.frame];
      Vec3f way;
      for (int axis = 0; axis < 3; ++axis) {
        way[axis] = track.step_m * static_cast<float>(b.value[axis] - a.value[axis]);
      }
      speeds.push_back(way.norm() * static_cast<float>(rate));
    }
  }
  if (moving.size() > 1) moving[0] = moving[1];
  const size_t moments = std::min(kMoments, data.frames);
  for (size_t m = 0; m < moments; ++m) {
    const size_t first = m * data.frames / moments, last = (m + 1) * data.frames / moments;
    data.moving.push_back(*std::max_element(moving.begin() + first, moving.begin() + last));
  }
  if (speeds.empty()) return;
  const auto at = speeds.begin() + static_cast<long>(speeds.size() * kOfFast / 100);
  std::nth_element(speeds.begin(), at, speeds.end());
  if (*at > 0) data.fast_m_s = *at;
}

void measure_overlaps(const ExportSource& source, const OverlapMeter& meter, ViewData& data) {
  if (!meter.of) return;
  ViewOverlaps& overlaps = data.overlaps;
  overlaps.diameter_m = meter.diameter_m;
  overlaps.frames = overlap_frames(data.frames, source.header().body_count());
  const size_t count = overlaps.frames.size();
  overlaps.depth.resize(data.shown.size() * count);
  for (size_t k = 0; k < count; ++k) {
    const std::vector<float> depths = meter.of(source.frame(overlaps.frames[k] * data.every));
    for (size_t i = 0; i < data.shown.size(); ++i) {
      const float units = kDepthUnits * depths[source.bodies()[data.shown[i]].id];
      overlaps.depth[i * count + k] = static_cast<uint16_t>(std::lround(std::min(units, 65535.0F)));
    }
  }
}

RenderMesh mesh_of(const TrajectoryShape& shape, bool is_painted, float plane_reach_m) {
  const float r = plane_reach_m;
  if (is_painted) {
    return make_render_mesh(shape.vertices, shape.triangles, shape.colours, shape.texture_map);
  }
  if (!shape.is_plane) return make_render_mesh(shape.vertices, shape.triangles);
  return make_render_mesh(
      std::array{Vec3f(-r, 0, -r), Vec3f(-r, 0, r), Vec3f(r, 0, r), Vec3f(r, 0, -r)},
      std::array<std::array<uint32_t, 3>, 2>{{{0, 1, 2}, {0, 2, 3}}});
}

// `pictures`: numbers of the mesh's textures.
void add_level(const RenderMesh& mesh, size_t index, const std::vector<uint32_t>& pictures,
               ViewMesh& view) {
  const MeshLevel& level = mesh.levels[index];
  const auto base = static_cast<uint32_t>(view.vertices.size());
  auto& [indices, runs] = view.levels.emplace_back();
  uint32_t count = 0;
  for (uint32_t i = 0; i < level.index_count; ++i) {
    const uint32_t corner = mesh.indices[level.first_index + i];
    count = std::max(count, corner + 1);
    indices.push_back(base + corner);
  }
  for (const TextureRun& run : level.runs) {
    runs.emplace_back(run.texture == 0 ? 0 : pictures[run.texture - 1], run.index_count);
  }
  const auto first = mesh.vertices.begin() + level.first_vertex;
  view.vertices.insert(view.vertices.end(), first, first + count);
}

std::string picture_of(const Texture& texture, bool& is_shrunk) {
  const int longer = std::max(texture.width, texture.height);
  if (longer <= kLargestPicture) return png_of(texture);
  is_shrunk = true;
  const auto side = [&](int texels) { return std::max(1, texels * kLargestPicture / longer); };
  return png_of(shrunk(texture, side(texture.width), side(texture.height)));
}

// Chooses the finest levels with at most kMostTriangles triangles for all bodies together.
void make_meshes(const ExportSource& source, ViewData& data) {
  const std::vector<TrajectoryShape>& shapes = source.header().shapes;
  std::vector<size_t> users(shapes.size()), level(shapes.size());
  std::vector<uint8_t> is_painted(shapes.size());
  for (const uint32_t i : data.shown) {
    const ExportBody& body = source.bodies()[i];
    ++users[body.shape];
    if (source.looks()[body.look].is_painted) is_painted[body.shape] = 1;
  }
  std::vector<RenderMesh> meshes;
  for (size_t s = 0; s < shapes.size(); ++s) {
    meshes.push_back(mesh_of(shapes[s], is_painted[s] != 0, kGroundReach * data.radius_m));
  }
  const auto triangles = [&](size_t s) {
    return users[s] * meshes[s].levels[level[s]].index_count / 3;
  };
  for (;;) {
    size_t total = 0, most = 0, worst = shapes.size();
    for (size_t s = 0; s < shapes.size(); ++s) {
      total += triangles(s);
      if (level[s] + 1 < meshes[s].levels.size() && triangles(s) > most) {
        most = triangles(s);
        worst = s;
      }
    }
    if (total <= kMostTriangles || worst == shapes.size()) break;
    ++level[worst];
  }
  NumberedTextures textures;
  for (size_t s = 0; s < shapes.size(); ++s) {
    ViewMesh& view = data.meshes.emplace_back();
    const TextureMap& map = shapes[s].texture_map;
    view.is_painted = is_painted[s] != 0;
    view.is_textured = view.is_painted && !map.empty();
    view.name = shapes[s].name;
    view.is_plane = shapes[s].is_plane;
    view.radius_m = meshes[s].radius_m;
    view.mean_chord_m = meshes[s].mean_chord_m;
    view.full_triangles = meshes[s].levels[0].index_count / 3;
    if (users[s] == 0) {
      view.levels.resize(2);
      continue;
    }
    std::vector<uint32_t> pictures;
    if (view.is_textured) {
      for (const auto& texture : map.textures) pictures.push_back(textures.number(*texture));
    }
    add_level(meshes[s], level[s], pictures, view);
    add_level(meshes[s], std::min(level[s] + 2, meshes[s].levels.size() - 1), pictures, view);
  }
  for (const Texture* texture : textures.all()) {
    data.pictures.push_back(picture_of(*texture, data.pictures_are_shrunk));
  }
}

template <class Value>
void append(std::string& bytes, const Value& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

void append_text(std::string& bytes, const std::string& text) {
  append(bytes, static_cast<uint32_t>(text.size()));
  bytes += text;
}

void append_mesh(std::string& bytes, const ViewMesh& mesh) {
  for (const RenderVertex& vertex : mesh.vertices) append(bytes, vertex.position);
  for (const RenderVertex& vertex : mesh.vertices) {
    for (const float n : vertex.normal) append(bytes, static_cast<int8_t>(std::lround(127 * n)));
    append(bytes, int8_t{0});
  }
  if (mesh.is_painted) {
    for (const RenderVertex& vertex : mesh.vertices) append(bytes, vertex.paint);
  }
  if (mesh.is_textured) {
    for (const RenderVertex& vertex : mesh.vertices) append(bytes, vertex.uv);
  }
  for (const ViewLevel& level : mesh.levels) {
    for (const uint32_t index : level.indices) append(bytes, index);
  }
}

// Second differences, which are small where motion is smooth: low bytes, then high bytes.
void append_channel(std::string& bytes, const std::vector<ViewTrack>& tracks, size_t channel) {
  std::string high;
  for (const ViewTrack& track : tracks) {
    uint16_t value = 0, way = 0;
    for (const ViewKey& key : track.keys) {
      const auto now = static_cast<uint16_t>(key.value[channel] - value);
      const auto change = static_cast<uint16_t>(now - way);
      bytes += static_cast<char>(change & 0xff);
      high += static_cast<char>(change >> 8);
      value = key.value[channel];
      way = now;
    }
  }
  bytes += high;
}

}  // namespace

std::vector<uint32_t> overlap_frames(size_t frames, size_t bodies) {
  const size_t count = std::clamp<size_t>(kMostMeasured / bodies, 1, frames);
  std::vector<uint32_t> chosen;
  for (size_t k = 1; k <= count; ++k) {
    chosen.push_back(static_cast<uint32_t>(k * frames / count - 1));
  }
  return chosen;
}

ViewData make_view_data(ExportSource& source, uint64_t most_bodies, const OverlapMeter& meter) {
  ViewData data;
  choose_bodies(source, most_bodies, data);
  choose_frames(source, data);
  data.tracks.resize(data.shown.size());
  find_places(source, data);
  widen_to_fixed_bodies(source, data);
  read_keys(source, data);
  measure_motion(source, data);
  measure_overlaps(source, meter, data);
  make_meshes(source, data);
  return data;
}

std::string view_bytes(const ExportSource& source, const ViewData& data, const std::string& signs) {
  const std::vector<ExportBody>& bodies = source.bodies();
  std::string bytes;
  nlohmann::json names = nlohmann::json::array();
  for (const uint32_t i : data.shown) names.push_back(bodies[i].name);
  append_text(bytes, names.dump());
  append_text(bytes, signs);
  for (const ViewMesh& mesh : data.meshes) append_mesh(bytes, mesh);
  for (const uint32_t i : data.shown) append(bytes, bodies[i].id);
  for (const uint32_t i : data.shown) append(bytes, bodies[i].shape);
  for (const uint32_t i : data.shown) {
    append(bytes, source.looks()[bodies[i].look].colour);
    append(bytes, static_cast<uint8_t>(moves(source, i) ? 1 : 0));
  }
  for (const uint32_t i : data.shown) {
    const ExportLook& look = source.looks()[bodies[i].look];
    for (const float share : {look.roughness, look.clear_coat}) {
      append(bytes, static_cast<uint8_t>(std::lround(255 * share)));
    }
    append(bytes, std::array<uint8_t, 2>{static_cast<uint8_t>(look.is_painted ? 1 : 0),
                                         surface_kind(source.header(), bodies[i].id)});
  }
  for (const uint32_t i : data.shown) {
    const auto& patterns = source.header().body_pattern;
    append(bytes, patterns.empty() ? PatternCode{0, 1} : patterns[bodies[i].id]);
  }
  for (const ViewTrack& track : data.tracks) {
    for (const float value : track.low) append(bytes, value);
  }
  for (const ViewTrack& track : data.tracks) append(bytes, track.step_m);
  for (const ViewTrack& track : data.tracks)
    append(bytes, static_cast<uint32_t>(track.keys.size()));
  for (const ViewTrack& track : data.tracks)
    append(bytes, static_cast<uint32_t>(track.states.size()));
  for (const ViewTrack& track : data.tracks) {
    for (const ViewKey& key : track.keys) append(bytes, key.frame);
  }
  for (size_t channel = 0; channel < 7; ++channel) append_channel(bytes, data.tracks, channel);
  for (const ViewTrack& track : data.tracks) {
    for (const auto& [frame, state] : track.states) append(bytes, frame);
  }
  for (const ViewTrack& track : data.tracks) {
    for (const auto& [frame, state] : track.states) append(bytes, state);
  }
  for (const uint16_t depth : data.overlaps.depth) append(bytes, depth);
  for (const std::string& picture : data.pictures) bytes += picture;
  return bytes;
}

}  // namespace pilesim
