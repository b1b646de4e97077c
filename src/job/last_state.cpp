#include "job/last_state.h"

#include <algorithm>
#include <map>
#include <vector>

#include "core/error.h"
#include "core/hash.h"
#include "job/run_filling.h"
#include "job/simulation_checkpoint.h"
#include "model/clear_starts.h"
#include "model/keep_bodies.h"
#include "trajectory/trajectory.h"

namespace pilesim {
namespace {

// In extents of a body: the deepest overlap at which exact engines let it sleep.
constexpr double kDeepestSleeping = 0.02;

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

// Movable bodies among `found`, except the `take` highest. At equal height, the first body is taken
// first.
std::vector<bool> left_by_taking(const Model& model, const std::vector<bool>& found, uint64_t take,
                                 const Vec3& gravity) {
  std::vector<std::pair<double, uint32_t>> heights;
  std::vector<bool> stays(model.bodies.size());
  for (uint32_t i = 0; i < model.bodies.size(); ++i) {
    stays[i] = model.bodies[i].role != Role::dynamic || found[i];
    if (found[i]) heights.emplace_back(gravity.dot(model.bodies[i].pose.position), i);
  }
  std::ranges::sort(heights);
  for (uint64_t i = 0; i < take; ++i) stays[heights[i].second] = false;
  return stays;
}

// Wakes overlapping bodies: asleep they would keep the overlap until an impact.
void wake_overlapping(Model& model) {
  for (const StartOverlap& pair : model.start_overlaps) {
    for (const uint32_t i : {pair.a, pair.b}) {
      ModelBody& body = model.bodies[i];
      if (pair.depth_m > kDeepestSleeping * model.shapes[body.shape].smallest_extent) {
        body.asleep = false;
      }
    }
  }
}

}  // namespace

LastState begin_from(const std::filesystem::path& directory, const Scene& scene, Model& model,
                     std::optional<uint64_t> take) {
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
  std::vector<bool> is_there;
  for (const uint8_t flags : there.flags) is_there.push_back((flags & kPresent) != 0);
  take_filling(header, is_there, model);
  // Results for pairs of shapes already compared: bodies share shapes.
  std::map<std::pair<uint32_t, uint32_t>, bool> same;
  LastState result;
  Hasher hasher;
  std::vector<bool> is_matched(model.bodies.size());
  for (size_t at = 0; at < model.bodies.size(); ++at) {
    ModelBody& body = model.bodies[at];
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
    body.asleep = (there.flags[i] & kAsleep) != 0 && scene.simulator.sleeping;
    body.linear_velocity = there.linear_velocity[i];
    body.angular_velocity = there.angular_velocity[i];
    ++result.matched;
    is_matched[at] = true;
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
  if (take && *take >= result.matched) {
    refuse(directory, "has " + std::to_string(result.matched) + " bodies that could be taken",
           "more than --take " + std::to_string(*take) + ", so that some are left");
  }
  if (take) {
    keep_bodies(left_by_taking(model, is_matched, *take, scene.gravity), model);
    model.guide_fill.reset();  // the bodies that fill it are not present
    result.taken = *take;
    result.matched -= *take;
    const uint64_t taken = *take;
    hasher.add_values(std::span(&taken, 1));
  }
  model.start_overlaps = find_start_overlaps(model);
  if (scene.simulator.mode == SimulatorMode::impulse) wake_overlapping(model);
  result.hash = hasher.digest();
  return result;
}

void require_whole_run(const std::filesystem::path& output) {
  try {
    TrajectoryReader reader(output);
    TrajectoryFrame frame;
    for (uint64_t i = 0; i < reader.frame_count(); ++i) reader.read(i, frame);
  } catch (const Error& error) {
    std::vector<Problem> problems = error.problems();
    for (Problem& problem : problems) {
      problem.remedy = "The run was complete and is damaged: simulate it again with --force";
    }
    throw Error(error.kind(), std::move(problems));
  }
}

}  // namespace pilesim
