#include <algorithm>
#include <array>
#include <cstdlib>

#include "json/json_text.h"
#include "target_support.h"
#include "targets.h"
#include "trajectory/trajectory.h"

namespace pilesim::fuzz {
namespace {

// Any JSON, with the positions of its values.
void json(std::string_view bytes) {
  accept_errors([&] {
    const std::string text(bytes);
    const Json value = parse_json(text, "a.json");
    size_t values = 0;
    walk_json(text, [&](const JsonPlace& place) { values += place.value_offset <= text.size(); });
    if (values == 0) std::abort();
  });
}

fs::path make_store() {
  const fs::path store = scratch() / "trajectory.zarr";
  TrajectoryHeader header{.resolved_scene = R"({"version": 1})",
                          .body_name = {"a", "b"},
                          .materials = {"wood"},
                          .body_shape = {0, 1},
                          .body_material = {0, 0},
                          .body_colour = {{1, 2, 3}, {4, 5, 6}},
                          .body_moves = {1, 0}};
  header.shapes = {{.name = "tetrahedron",
                    .vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                    .triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}},
                   {.name = "ground", .is_plane = true}};
  TrajectoryWriter writer(store, header);
  const TrajectoryFrame frame{.position = {Vec3::Zero(), Vec3::Ones()},
                              .orientation = {Quatf::Identity(), Quatf::Identity()},
                              .state = {1, 1}};
  for (int i = 0; i < 3; ++i) writer.append(frame);
  writer.close();
  return store;
}

// The first byte selects the file of a whole store that the others replace.
void trajectory(std::string_view bytes) {
  static const fs::path store = make_store();
  constexpr std::array kFiles = {".zattrs",
                                 "position/.zarray",
                                 "position/0.0.0",
                                 "state/.zarray",
                                 "state/0.0",
                                 "body_shape/.zarray",
                                 "body_shape/0",
                                 "shapes/0/vertices/.zarray",
                                 "shapes/0/vertices/0.0",
                                 "shapes/0/triangles/0.0"};
  if (bytes.empty()) return;
  const fs::path file = store / kFiles[static_cast<uint8_t>(bytes[0]) % kFiles.size()];
  const std::string whole = read_file(file);
  write_file_atomically(file, bytes.substr(1));
  accept_errors([&] {
    TrajectoryReader reader(store);
    TrajectoryFrame frame;
    for (uint64_t i = 0; i < std::min<uint64_t>(reader.frame_count(), 4); ++i) {
      reader.read(i, frame);
    }
  });
  write_file_atomically(file, whole);
}

}  // namespace

std::span<const Target> format_targets() {
  static constexpr std::array kTargets = {Target{"json", json}, Target{"trajectory", trajectory}};
  return kTargets;
}

}  // namespace pilesim::fuzz
