#include "job/simulation_job.h"

#include <algorithm>

#include "core/clock.h"
#include "core/counted.h"
#include "core/error.h"
#include "core/interrupt.h"
#include "core/output_directory.h"
#include "core/parallel_for.h"
#include "inspect/pile_inspection.h"
#include "job/direction.h"
#include "job/guide_direction.h"
#include "model/model.h"
#include "report/report_writer.h"
#include "scene/scene_files.h"
#include "scene/scene_loader.h"
#include "simulate/simulator.h"
#include "trajectory/trajectory.h"

namespace pilesim {
namespace {

TrajectoryHeader make_header(const LoadedScene& loaded, const std::string& scene_hash,
                             const Model& model) {
  TrajectoryHeader header;
  header.frame_rate = loaded.scene.frame_rate;
  header.seed = loaded.scene.seed;
  header.resolved_scene = loaded.portable;
  header.scene_hash = scene_hash;
  for (const ModelShape& shape : model.shapes) {
    TrajectoryShape& stored = header.shapes.emplace_back();
    stored.name = shape.name;
    stored.is_plane = shape.is_plane;
    for (const Vec3& vertex : shape.mesh.vertices) {
      stored.vertices.emplace_back(vertex.cast<float>());
    }
    stored.triangles = shape.mesh.triangles;
  }
  for (const ModelBody& body : model.bodies) {
    header.body_name.push_back(body.name);
    header.body_shape.push_back(body.shape);
    header.body_colour.push_back(body.colour);
    header.body_moves.push_back(body.role == Role::fixed ? 0 : 1);
  }
  return header;
}

void copy_states(const BodyStates& states, TrajectoryFrame& frame) {
  frame.position.resize(states.size());
  frame.orientation.resize(states.size());
  for (size_t body = 0; body < states.size(); ++body) {
    frame.position[body] = states.position[body].cast<float>();
    frame.orientation[body] = states.orientation[body].cast<float>();
  }
  frame.state = states.flags;
}

FrameRow make_row(uint64_t frame, double frame_rate, const FrameStatistics& statistics) {
  return {.frame = frame,
          .time_s = static_cast<double>(frame) / frame_rate,
          .steps = statistics.steps,
          .times = statistics.times,
          .bodies_present = statistics.bodies_present,
          .bodies_awake = statistics.bodies_awake,
          .contacts = statistics.contacts,
          .deepest_penetration_m = statistics.deepest_penetration_m,
          .kinetic_energy_j = statistics.kinetic_energy_j,
          .potential_energy_j = statistics.potential_energy_j};
}

SimulationReport begin_report(const SimulationJob& job, const LoadedScene& loaded,
                              const Model& model) {
  SimulationReport report;
  report.command = job.direct_piles ? "direct-pile" : "simulate";
  report.scene_name = loaded.scene.name;
  report.scene_file = job.scene_file.filename().string();
  report.scene_hash = scene_hash(loaded);
  report.mode = mode_name(loaded.scene.simulator.mode);
  report.changed_options = loaded.changed_options;
  report.seed = loaded.scene.seed;
  report.threads = thread_count();
  report.step_s = loaded.scene.actual_step_s();
  double diameters_m = 0;
  for (const ModelBody& body : model.bodies) {
    if (body.role != Role::dynamic) continue;
    ++report.dynamic_bodies;
    diameters_m += 2 * model.shapes[body.shape].bounding_radius;
  }
  report.body_diameter_m =
      diameters_m / static_cast<double>(std::max<uint64_t>(1, report.dynamic_bodies));
  for (const ModelShape& shape : model.shapes) {
    if (!shape.collision_report.empty()) {
      report.collision_shapes.push_back(shape.name + ": " + shape.collision_report);
    }
  }
  return report;
}

// Steps the simulator through all frames into `writer`, `timing` and `rows`. True: interrupted.
bool simulate_frames(const Scene& scene, Simulator& simulator, TrajectoryWriter& writer,
                     TimingCsv& timing, std::vector<FrameRow>& rows, Progress& progress) {
  const auto frame_count = static_cast<uint64_t>(scene.frame_count());
  TrajectoryFrame stored;
  for (uint64_t frame = 0; frame < frame_count; ++frame) {
    FrameStatistics statistics = frame == 0 ? simulator.statistics() : simulator.step_frame();

    const Stopwatch output;
    copy_states(simulator.states(), stored);
    writer.append(stored);
    const double output_s = output.seconds();
    statistics.times.seconds[static_cast<size_t>(Stage::output)] += output_s;
    statistics.times.total_s += output_s;

    rows.push_back(make_row(frame, scene.frame_rate, statistics));
    timing.append(rows.back());
    progress.update(frame + 1);
    if (interrupted() && frame + 1 < frame_count) return true;
  }
  return false;
}

void throw_failed_gates(const SimulationJob& job, const std::vector<GateResult>& results) {
  std::vector<Problem> problems;
  for (const GateResult& result : results) {
    if (result.passed) continue;
    problems.push_back({.file = job.output.string(),
                        .found = describe_failure(result),
                        .expected = "not " + result.gate.text});
  }
  if (!problems.empty()) throw Error(ErrorKind::quality, std::move(problems));
}

[[noreturn]] void rethrow_with_what_is_safe(const Error& error, const std::filesystem::path& output,
                                            uint64_t frames) {
  std::vector<Problem> problems = error.problems();
  problems.push_back({.file = (output / "trajectory.zarr").string(),
                      .found = "holds the " + counted(frames, "frame") +
                               " that were complete before; they are valid"});
  throw Error(error.kind(), std::move(problems));
}

}  // namespace

SimulationSummary run_simulation(const SimulationJob& job) {
  const Stopwatch watch;
  const auto replaced = claim_output(job.output, kSimulationEntries, job.force);
  const LoadedScene loaded = load_scene(job.scene_file, job.overrides);
  const Scene& scene = loaded.scene;
  Model model = build_model(scene);
  const GuideFilling filling = fill_guide_of(job.scene_file, scene, model);
  const std::unique_ptr<Direction> direction =
      job.direct_piles ? direction_of(job.scene_file, scene, model, filling)
                       : no_direction(scene, model);
  const std::unique_ptr<Simulator> simulator = direction->make_simulator();
  SimulationReport report = begin_report(job, loaded, model);
  report.signatures = simulator->signatures();
  report.setup_s = watch.seconds();

  // From here on there is something to bring to a good end; before, Ctrl-C may just kill.
  install_interrupt_handler();
  remove_output(replaced);
  make_output_directory(job.output);
  TrajectoryWriter writer(job.output / "trajectory.zarr",
                          make_header(loaded, report.scene_hash, model));
  TimingCsv timing(job.output / "timing.csv");
  try {
    Progress progress(job.progress, "simulate", static_cast<uint64_t>(scene.frame_count()),
                      "frames");
    const double cpu_start_s = process_cpu_s();
    report.interrupted = simulate_frames(scene, *simulator, writer, timing, report.rows, progress);
    writer.close();
    report.cpu_s = process_cpu_s() - cpu_start_s;
  } catch (const Error& error) {
    rethrow_with_what_is_safe(error, job.output, writer.frames_on_disk());
  }
  const Stopwatch inspection;
  report.quality = inspect_pile(model, scene.gravity, simulator->states());
  report.inspection_s = inspection.seconds();
  report.gates = judge(job.gates, report.quality);
  report.total_s = watch.seconds();
  report.peak_memory_bytes = peak_memory_bytes();
  report.mode_figures = simulator->figures();
  direction->measure(*simulator);
  report.piles = direction->figures();
  direction->write_files(job.output);
  const std::string missing = write_report(report, job.output);

  if (report.interrupted) {
    throw Error(
        ErrorKind::interrupted,
        Problem{.file = job.output.string(),
                .found = "interrupted; holds " + std::to_string(report.rows.size()) + " of " +
                         std::to_string(scene.frame_count()) + " frames and their report"});
  }
  throw_failed_gates(job, report.gates);
  SimulationSummary summary{.frames = writer.frames_on_disk(),
                            .bodies = model.bodies.size(),
                            .simulated_s = report.rows.back().time_s,
                            .wall_s = report.total_s,
                            .awake_at_end = report.rows.back().bodies_awake,
                            .quality = report.quality,
                            .collision_shapes = report.collision_shapes,
                            .signatures = report.signatures};
  summary.piles = direction->lines();
  if (!missing.empty()) summary.warnings.push_back(missing);
  for (const FrameRow& row : report.rows) {
    summary.deepest_penetration_m =
        std::max(summary.deepest_penetration_m, row.deepest_penetration_m);
  }
  return summary;
}

}  // namespace pilesim
