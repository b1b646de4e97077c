#include "job/simulation_job.h"

#include <algorithm>
#include <optional>

#include "core/checkpoint_pace.h"
#include "core/clock.h"
#include "core/counted.h"
#include "core/error.h"
#include "core/interrupt.h"
#include "core/naming.h"
#include "core/output_directory.h"
#include "core/parallel_for.h"
#include "core/text.h"
#include "inspect/pile_inspection.h"
#include "job/direction.h"
#include "job/end_picture.h"
#include "job/finish_stage.h"
#include "job/guide_direction.h"
#include "job/last_state.h"
#include "job/measured_signatures.h"
#include "job/run_report.h"
#include "job/settling.h"
#include "job/simulation_checkpoint.h"
#include "json/json_text.h"
#include "model/clear_starts.h"
#include "model/model.h"
#include "report/report_json.h"
#include "report/report_writer.h"
#include "scene/scene_files.h"
#include "scene/scene_loader.h"
#include "simulate/lifecycle.h"
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
  return header;
}

void copy_states(const BodyStates& states, TrajectoryFrame& frame) {
  frame.position.resize(states.size());
  frame.orientation.resize(states.size());
  for (size_t body = 0; body < states.size(); ++body) {
    frame.position[body] = states.position[body];
    frame.orientation[body] = states.orientation[body].cast<float>();
  }
  frame.state = states.flags;
}

// Writes the files of a run during the run, and keeps its totals.
class Recorder {
 public:
  // Continues after `progress.rows.size()` frames; without progress it begins.
  Recorder(const SimulationJob& job, CheckpointKey key, const TrajectoryHeader& header,
           RunProgress progress, const Stopwatch& watch)
      : directory_(job.output),
        scene_file_(job.scene_file),
        key_(std::move(key)),
        writer_(open(directory_ / "trajectory.zarr", header, progress.rows.size())),
        timing_(directory_ / "timing.csv"),
        pace_(job.checkpoint_period_s),
        progress_(std::move(progress)),
        before_{.cpu_s = progress_.cpu_s - process_cpu_s(), .wall_s = progress_.wall_s},
        watch_(watch) {
    for (const FrameRow& row : progress_.rows) timing_.append(row);
  }

  void append(const Model& model, const Simulator& simulator, double frame_rate,
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
  }

  void inspect(const Model& model, const Vec3& gravity, const BodyStates& states) {
    progress_.inspections.push_back(
        {progress_.rows.size() - 1, inspect_pile(model, gravity, states)});
  }

  // True if the run is over.
  bool watch_settling(const Settling& settling, const Simulator& simulator) {
    progress_.is_settled =
        settling.is_over(progress_.rows.size() - 1, simulator, progress_.quiet_frames,
                         [&](uint64_t frame) { return places_before(frame); });
    return progress_.is_settled;
  }

  // Positions of the bodies at an earlier frame.
  EarlierPlaces places_before(uint64_t frame) {
    writer_.flush();
    return places_at(directory_, frame, progress_.rows.size() - 1);
  }

  bool is_checkpoint_due() const { return progress_.rows.size() == 1 || pace_.is_due(); }
  // Everything that a checkpoint or the last states refer to is on disk before them.
  void write_end(const BodyStates& states) {
    writer_.flush();
    write_last_states(directory_, key_, scene_file_, states);
  }
  void write_checkpoint(const Simulator& simulator) {
    const Stopwatch clock;
    writer_.flush();
    measure_time();
    write_run_checkpoint(directory_, key_, scene_file_, progress_, simulator);
    const double took_s = clock.seconds();
    progress_.checkpoint_s += took_s;
    pace_.wrote(took_s);
  }

  const RunProgress& progress() const { return progress_; }
  uint64_t frames_on_disk() const { return writer_.frames_on_disk(); }
  // Adds the times of earlier processes to those of this one.
  void measure_time() {
    progress_.cpu_s = before_.cpu_s + process_cpu_s();
    progress_.wall_s = before_.wall_s + watch_.seconds();
  }

 private:
  static TrajectoryWriter open(const std::filesystem::path& directory,
                               const TrajectoryHeader& header, uint64_t frames) {
    if (frames == 0) return {directory, header};
    return {directory, frames, header};
  }

  std::filesystem::path directory_, scene_file_;
  CheckpointKey key_;
  TrajectoryWriter writer_;
  TimingCsv timing_;
  CheckpointPace pace_;
  RunProgress progress_;
  struct {
    double cpu_s, wall_s;
  } before_;
  const Stopwatch& watch_;
  TrajectoryFrame stored_;
};

// Steps the simulator through all remaining frames. True if interrupted.
bool simulate_frames(const Scene& scene, const Model& model, uint64_t inspect_every,
                     Simulator& simulator, Recorder& recorder, Progress& progress) {
  const auto frame_count = static_cast<uint64_t>(scene.frame_count());
  const Settling settling(scene, model);
  if (recorder.progress().is_settled) return false;
  for (uint64_t frame = recorder.progress().rows.size(); frame < frame_count; ++frame) {
    recorder.append(model, simulator, scene.frame_rate,
                    frame == 0 ? simulator.statistics() : simulator.step_frame());
    if (inspect_every > 0 && frame % inspect_every == 0) {
      recorder.inspect(model, scene.gravity, simulator.states());
    }
    progress.update(frame + 1);
    if (scene.until == Until::settled && recorder.watch_settling(settling, simulator)) break;
    if (frame + 1 == frame_count) break;
    const bool stops = interrupted();
    if (stops || recorder.is_checkpoint_due()) recorder.write_checkpoint(simulator);
    if (stops) return true;
  }
  return false;
}

// Read it from disk: the error may be that the output was removed.
std::string what_is_safe(const std::filesystem::path& output) {
  try {
    const uint64_t frames = TrajectoryReader(output).frame_count();
    return "holds " + counted(frames, "complete frame") + " and is valid";
  } catch (const Error&) {
    return "does not exist any more, or is damaged";
  }
}

[[noreturn]] void rethrow_with_what_is_safe(const Error& error,
                                            const std::filesystem::path& output) {
  std::vector<Problem> problems = error.problems();
  problems.push_back(
      {.file = (output / "trajectory.zarr").string(), .found = what_is_safe(output)});
  throw Error(error.kind(), std::move(problems));
}

// True if a run was killed before its first checkpoint.
bool has_hardly_begun(const std::filesystem::path& output) {
  if (std::filesystem::exists(output / "report.json")) return false;
  try {
    return TrajectoryReader(output).frame_count() <= 1;
  } catch (const Error&) {
    return true;  // even the trajectory's header is incomplete
  }
}

// The checkpoint to resume from; none if no run has begun. Throws Error(usage) for results without
// a checkpoint.
std::optional<RunCheckpoint> find_checkpoint(const SimulationJob& job) {
  const auto there = claim_output(job.output, kSimulationEntries, true);
  if (there.empty()) return std::nullopt;
  if (std::ranges::find(there, job.output / kCheckpointFile) != there.end()) {
    return RunCheckpoint(job.output);
  }
  if (has_hardly_begun(job.output)) return std::nullopt;
  throw_nothing_to_resume(job.output);
}

// Entries of a resumed run's directory that its next results replace.
std::vector<std::filesystem::path> outdated(const std::filesystem::path& directory) {
  auto entries = claim_output(directory, kSimulationEntries, true);
  std::erase_if(entries, [](const std::filesystem::path& entry) {
    const std::string name = entry.filename().string();
    return name == "trajectory.zarr" || name == "simulated.zarr" || name == "timing.csv" ||
           name == kCheckpointFile || name == kFinishingFile;
  });
  return entries;
}

}  // namespace

SimulationSummary run_simulation(const SimulationJob& job) {
  const Stopwatch watch;
  OutputLock lock(job.output);
  const std::optional<RunCheckpoint> checkpoint = job.resume ? find_checkpoint(job) : std::nullopt;
  const auto replaced = checkpoint
                            ? outdated(job.output)
                            : claim_output(job.output, kSimulationEntries, job.force || job.resume);
  const LoadedScene loaded = load_scene(job.scene_file, job.overrides);
  const Scene& scene = loaded.scene;
  const std::string scene_file = job.scene_file.string();
  Model model = naming(scene_file, [&] { return build_model(scene); });
  const LastState begun_from =
      job.from ? begin_from(*job.from, scene, model, job.take) : LastState{};
  // Before filling the guide changes the numbering of bodies.
  std::vector<std::string> warnings = describe_start_overlaps(model);
  if (!job.direct_piles && scene.guide) {
    warnings.emplace_back(
        "simulate holds nothing in the scene's \"guide\": pilesim direct-pile does");
  }
  if (!job.direct_piles && !scene.piles.empty()) {
    warnings.emplace_back(
        "simulate steers to no angle of the scene's \"piles\": pilesim direct-pile does");
  }
  const GuideFilling filling = fill_guide_of(job.scene_file, scene, model);
  if (filling.floats) {
    warnings.emplace_back(
        "the guide is in the air: the bodies in it touch no fixed body, and fall; move it down, or "
        "put a static body below it");
  }
  for (const EmptyPart& part : filling.empty.parts) {
    warnings.push_back("guide: " + describe(part));
  }
  if (std::string line = describe_unkept_signatures(scene, model); !line.empty()) {
    warnings.push_back(std::move(line));
  }
  const std::unique_ptr<Direction> direction =
      job.direct_piles ? direction_of(job.scene_file, scene, model, filling)
                       : no_direction(scene, model);
  SimulationReport report =
      begin_report(job.direct_piles ? "direct-pile" : "simulate", job.scene_file, loaded, model);
  const CheckpointKey key{.command = report.command,
                          .program = program_hash(),
                          .scene = report.scene_hash,
                          .start = begun_from.hash};
  if (checkpoint) checkpoint->require(key);
  report.notes = describe_moved_starts(model);
  for (const std::string& line : warnings) {
    report.notes.push_back(line);
    if (job.warn) job.warn(line);
  }
  if (checkpoint && checkpoint->is_done()) {
    require_whole_run(job.output);
    forget_finishing(job.output);
    SimulationSummary nothing_left{.was_complete = true};
    if (job.picture) nothing_left.warn(put_missing_end_picture(job.output, scene));
    require_gates(job.output, job.gates);
    return nothing_left;
  }
  report.signatures_s =
      naming(scene_file, [&] { return measure_signatures(scene, model, job.progress); });
  const std::unique_ptr<Simulator> simulator =
      naming(scene_file, [&] { return direction->make_simulator(); });
  report.signatures = simulator->signatures();
  RunProgress before;
  if (checkpoint) {
    restore_simulated(job.output);
    before = checkpoint->load(*simulator);
  }
  const size_t frames_before = before.rows.size();
  report.setup_s = watch.seconds();

  // From here on an interrupted run can save its work; before, Ctrl-C may simply kill it.
  install_interrupt_handler();
  lock.make_directory();
  remove_output(replaced);
  Recorder recorder(job, key, make_header(loaded, report.scene_hash, model), std::move(before),
                    watch);
  try {
    Progress progress(job.progress, "simulate", static_cast<uint64_t>(scene.frame_count()),
                      "frames");
    report.interrupted =
        simulate_frames(scene, model, job.inspect_every, *simulator, recorder, progress);
  } catch (const Error& error) {
    rethrow_with_what_is_safe(in_file(error, scene_file), job.output);
  }
  std::optional<FinishedPile> finished;
  if (scene.finish && !report.interrupted) {
    recorder.write_checkpoint(*simulator);
    finished = finish_in_place(
        {scene, model, settings_of(*scene.finish), job.progress, key, job.checkpoint_period_s},
        job.output);
    report.interrupted = finished->figures.interrupted;
  }
  const bool is_finished = finished && !report.interrupted;
  const BodyStates& end = is_finished ? finished->states : simulator->states();
  recorder.measure_time();
  report.rows = recorder.progress().rows;
  report.inspections = recorder.progress().inspections;
  report.frames = report.rows.size();
  report.cpu_s = recorder.progress().cpu_s;
  report.checkpoint_s = recorder.progress().checkpoint_s;
  const Stopwatch inspection;
  const uint64_t last = report.frames - 1;
  const auto quiet = static_cast<uint64_t>(quiet_time_s(model, scene.gravity) * scene.frame_rate);
  const EarlierPlaces earlier = quiet > 0 && quiet <= last && !finished
                                    ? recorder.places_before(last - quiet)
                                    : EarlierPlaces{};
  report.quality = is_finished ? inspect_finished(scene, model, *finished)
                               : inspect_pile(model, scene.gravity, end, earlier);
  report.inspection_s = inspection.seconds();
  if (scene.until == Until::settled) {
    const uint64_t unsettled = count_unsettled(model, scene.gravity, simulator->states(), earlier);
    report.until =
        Settling(scene, model).figures(last, unsettled, recorder.progress().quiet_frames);
  }
  report.total_s = recorder.progress().wall_s + report.inspection_s;
  report.peak_memory_bytes = peak_memory_bytes();
  report.mode_figures = simulator->figures();
  const std::vector<std::string> notes = simulator->notes();
  report.notes.insert(report.notes.end(), notes.begin(), notes.end());
  const std::vector<std::string> stops = simulator->life().stops();
  report.notes.insert(report.notes.end(), stops.begin(), stops.end());
  report.dynamic_bodies -= simulator->life().stopped();
  DirectedRun directed = direction->finish(*simulator, job.output);
  report.piles = std::move(directed.figures);
  report.gates = judge(job.gates, report.quality, directed.guide);
  if (is_finished) take_finish(*finished, report);
  const std::string no_charts = write_report(report, job.output);
  // Written last: a process killed before continues from the previous checkpoint.
  if (!report.interrupted) {
    recorder.write_end(end);
    forget_finishing(job.output);
  }
  const std::string no_picture = job.picture ? put_end_picture(job.output, scene) : "";

  if (report.interrupted) {
    throw Error(
        ErrorKind::interrupted,
        Problem{.file = job.output.string(),
                .found = "interrupted; holds " + std::to_string(report.rows.size()) + " of " +
                         std::to_string(scene.frame_count()) + " frames and their report" +
                         (finished ? "; the pile is not finished" : ""),
                .remedy = "Go on with the same command and --resume"});
  }
  throw_failed_gates(job.output, report.gates);
  SimulationSummary summary{.frames = recorder.frames_on_disk(),
                            .bodies = report.dynamic_bodies,
                            .static_bodies = report.static_bodies,
                            .kinematic_bodies = report.kinematic_bodies,
                            .frame_rate = report.frame_rate,
                            .simulated_s = report.rows.back().time_s,
                            .wall_s = report.total_s,
                            .quality = report.quality,
                            .collision_shapes = report.collision_shapes,
                            .signatures = report.signatures};
  if (begun_from.matched > 0) {
    summary.beginning.push_back(
        "from " + job.from->string() + ": " + counted(begun_from.matched, "body", "bodies") +
        " begin where they lay" +
        (begun_from.taken > 0 ? ", " + std::to_string(begun_from.taken) + " were taken from the top"
                              : ""));
  }
  if (report.signatures_s > 0) {
    summary.beginning.push_back("signatures measured in " + with_digits(report.signatures_s, 3) +
                                " s");
  }
  for (std::string& line : describe_moved_starts(model)) summary.beginning.push_back(line);
  if (frames_before > 0) {
    summary.beginning.push_back("resumed after " + counted(frames_before, "frame"));
  }
  for (const std::string& line : stops) summary.beginning.push_back(line);
  summary.piles = std::move(directed.lines);
  if (is_finished) {
    if (finished->steps_before > 0) summary.beginning.push_back(resumed_after(*finished));
    summary.piles.push_back(describe(finished->figures));
  }
  summary.warn(no_charts);
  summary.warn(no_picture);
  for (const std::string& note : notes) summary.warn(note);
  if (!report.inspections.empty()) summary.deepest_inspected = deepest_of(report.inspections);
  return summary;
}

}  // namespace pilesim
