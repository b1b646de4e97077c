#include "job/run_recorder.h"

#include <algorithm>
#include <utility>

#include "job/run_report.h"
#include "json/json_text.h"

namespace pilesim {
namespace {

void copy_states(const BodyStates& states, TrajectoryFrame& frame) {
  frame.position.resize(states.size());
  frame.orientation.resize(states.size());
  for (size_t body = 0; body < states.size(); ++body) {
    frame.position[body] = states.position[body];
    frame.orientation[body] = states.orientation[body].cast<float>();
  }
  frame.state = states.flags;
}

TrajectoryWriter open_trajectory(const std::filesystem::path& directory,
                                 const TrajectoryHeader& header, uint64_t frames) {
  if (frames == 0) return {directory, header};
  return {directory, frames, header};
}

}  // namespace

TrajectoryHeader make_header(const LoadedScene& loaded, const std::string& scene_hash,
                             const Model& model) {
  TrajectoryHeader header;
  header.frame_rate = loaded.scene.frame_rate;
  header.seed = loaded.scene.seed;
  header.resolved_scene = loaded.portable;
  header.scene_hash = scene_hash;
  for (const auto& [name, material] : loaded.scene.materials) header.materials.push_back(name);
  const Json sources = parse_json(loaded.portable, "scene").at("shapes");
  for (const ModelShape& shape : model.shapes) {
    TrajectoryShape& stored = header.shapes.emplace_back();
    stored.name = shape.name;
    stored.is_plane = shape.is_plane;
    for (const Vec3& vertex : shape.mesh.vertices) {
      stored.vertices.emplace_back(vertex.cast<float>());
    }
    stored.triangles = shape.mesh.triangles;
    stored.colours = shape.mesh.colours;
    stored.texture_map = shape.mesh.texture_map;
    stored.round = shape.round;
    const Json& source = sources.at(shape.source);
    stored.type = source.at("type");
    stored.file = source.value("file", "");
    stored.scale = shape.file_scale * shape.size;
    stored.is_z_up = shape.file_up == UpAxis::z;
    stored.centre_of_mass = shape.origin_offset;
    stored.principal_axes = principal_inertia(shape.mass.inertia_m5).axes;
  }
  for (const ModelBody& body : model.bodies) {
    header.body_name.push_back(body.name);
    header.body_shape.push_back(body.shape);
    header.body_material.push_back(body.material);
    header.body_colour.push_back(body.colour);
    header.body_painted.push_back(body.is_painted ? 1 : 0);
    const Look& look = body.look;
    header.body_gloss.push_back(
        {static_cast<float>(look.roughness), static_cast<float>(look.clear_coat)});
    header.body_substance.push_back({static_cast<float>(look.metallic),
                                     static_cast<float>(look.transmission),
                                     static_cast<float>(look.emission)});
    header.body_pattern.push_back(
        {static_cast<float>(look.pattern), static_cast<float>(look.pattern_m)});
    header.body_moves.push_back(body.role == Role::fixed ? 0 : 1);
  }
  const auto is_plain = [](const std::array<float, 2>& gloss) {
    const Look plain;
    return gloss ==
           std::array{static_cast<float>(plain.roughness), static_cast<float>(plain.clear_coat)};
  };
  if (std::ranges::all_of(header.body_gloss, is_plain)) header.body_gloss.clear();
  const auto is_opaque = [](const std::array<float, 3>& substance) {
    return substance == std::array<float, 3>{};
  };
  if (std::ranges::all_of(header.body_substance, is_opaque)) header.body_substance.clear();
  const auto is_even = [](const std::array<float, 2>& pattern) { return pattern[0] == 0; };
  if (std::ranges::all_of(header.body_pattern, is_even)) header.body_pattern.clear();
  return header;
}

RunRecorder::RunRecorder(std::filesystem::path directory, std::filesystem::path scene_file,
                         double checkpoint_period_s, CheckpointKey key,
                         const TrajectoryHeader& header, RunProgress progress,
                         const Stopwatch& watch)
    : directory_(std::move(directory)),
      scene_file_(std::move(scene_file)),
      key_(std::move(key)),
      writer_(open_trajectory(directory_ / "trajectory.zarr", header, progress.rows.size())),
      timing_(directory_ / "timing.csv"),
      pace_(checkpoint_period_s),
      progress_(std::move(progress)),
      before_{.cpu_s = progress_.cpu_s - process_cpu_s(), .wall_s = progress_.wall_s},
      watch_(watch) {
  for (const FrameRow& row : progress_.rows) timing_.append(row);
}

void RunRecorder::append(const Model& model, const Simulator& simulator, double frame_rate,
                         FrameStatistics statistics) {
  const Stopwatch output;
  copy_states(simulator.states(), stored_);
  writer_.append(stored_);
  const double output_s = output.seconds();
  statistics.times.seconds[static_cast<size_t>(Stage::output)] += output_s;
  statistics.times.total_s += output_s;
  progress_.rows.push_back(make_row(progress_.rows.size(),
                                    static_cast<double>(progress_.rows.size()) / frame_rate,
                                    statistics, count_present(model, simulator.states())));
  timing_.append(progress_.rows.back());
  progress_.broke_at.resize(simulator.broken_joints().size(), progress_.rows.size() - 1);
}

void RunRecorder::inspect(const Model& model, const Vec3& gravity, const BodyStates& states) {
  progress_.inspections.push_back(
      {progress_.rows.size() - 1, inspect_pile(model, gravity, states)});
}

bool RunRecorder::watch_settling(const Settling& settling, const Simulator& simulator) {
  progress_.is_settled =
      settling.is_over(progress_.rows.size() - 1, simulator, progress_.quiet_frames,
                       [&](uint64_t frame) { return places_before(frame); });
  return progress_.is_settled;
}

EarlierPlaces RunRecorder::places_before(uint64_t frame) {
  writer_.flush();
  return places_at(directory_, frame, progress_.rows.size() - 1);
}

void RunRecorder::write_end(const BodyStates& states) {
  writer_.flush();
  write_last_states(directory_, key_, scene_file_, states);
}

void RunRecorder::write_checkpoint(const Simulator& simulator) {
  const Stopwatch clock;
  writer_.flush();
  measure_time();
  write_run_checkpoint(directory_, key_, scene_file_, progress_, simulator);
  const double took_s = clock.seconds();
  progress_.checkpoint_s += took_s;
  pace_.wrote(took_s);
}

void RunRecorder::measure_time() {
  progress_.cpu_s = before_.cpu_s + process_cpu_s();
  progress_.wall_s = before_.wall_s + watch_.seconds();
}

}  // namespace pilesim
