#include "job/last_state.h"

#include <map>
#include <vector>

#include "core/error.h"
#include "core/hash.h"
#include "job/simulation_checkpoint.h"
#include "trajectory/trajectory.h"

namespace pilesim {
namespace {

bool is_same_shape(const ModelShape& shape, const TrajectoryShape& there) {
  const std::vector<Vec3>& vertices = shape.mesh.vertices;
  if (shape.is_plane != there.is_plane || shape.mesh.triangles != there.triangles ||
      vertices.size() != there.vertices.size()) {
    return false;
  }
  for (size_t i = 0; i < vertices.size(); ++i) {
    if (vertices[i].cast<float>() != there.vertices[i]) return false;
  }
  return true;
}

[[noreturn]] void refuse(const std::filesystem::path& directory, std::string found,
                         std::string expected) {
  throw Error(ErrorKind::input, Problem{.file = directory.string(),
                                        .found = std::move(found),
                                        .expected = std::move(expected)});
}

}  // namespace

LastState begin_from(const std::filesystem::path& directory, Model& model) {
  const TrajectoryReader trajectory(directory);
  const TrajectoryHeader& header = trajectory.header();
  const RunCheckpoint checkpoint(directory);
  const BodyStates& there = checkpoint.bodies();
  if (there.size() != header.body_count()) {
    refuse(directory, "has a checkpoint of " + std::to_string(there.size()) + " bodies",
           std::to_string(header.body_count()) + ", as its trajectory has");
  }
  std::map<std::string, uint32_t> by_name;
  for (uint32_t i = 0; i < header.body_count(); ++i) {
    if ((there.flags[i] & kPresent) != 0) by_name.emplace(header.body_name[i], i);
  }
  // Of a pair of shapes, whether they were compared: bodies share them.
  std::map<std::pair<uint32_t, uint32_t>, bool> same;
  LastState result;
  Hasher hasher;
  for (ModelBody& body : model.bodies) {
    const auto found = by_name.find(body.name);
    if (body.role != Role::dynamic || found == by_name.end()) continue;
    const uint32_t i = found->second;
    const uint32_t shape = header.body_shape[i];
    const auto [is_same, is_new] = same.try_emplace({body.shape, shape});
    if (is_new) is_same->second = is_same_shape(model.shapes[body.shape], header.shapes[shape]);
    if (!is_same->second) {
      refuse(directory, "'" + body.name + "' has the shape '" + header.shapes[shape].name + "'",
             "the shape that the scene gives it: '" + model.shapes[body.shape].name + "'");
    }
    body.start_s = 0;
    body.pose = {there.position[i], there.orientation[i]};
    body.asleep = (there.flags[i] & kAsleep) != 0;
    body.linear_velocity = there.linear_velocity[i];
    body.angular_velocity = there.angular_velocity[i];
    ++result.matched;
    hasher.add_values(std::span(&there.position[i], 1));
    hasher.add_values(std::span(&there.orientation[i], 1));
    hasher.add_values(std::span(&there.linear_velocity[i], 1));
    hasher.add_values(std::span(&there.angular_velocity[i], 1));
    hasher.add_values(std::span(&there.flags[i], 1));
  }
  if (result.matched == 0) {
    refuse(directory, "has no body with the name of one of the scene that can move",
           "names in common, such as those of an emitter that both scenes have");
  }
  result.hash = hasher.digest();
  return result;
}

}  // namespace pilesim
