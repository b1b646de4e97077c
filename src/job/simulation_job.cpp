#include "job/simulation_job.h"

#include <algorithm>
#include <iterator>
#include <optional>

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
#include "job/run_recorder.h"
#include "job/run_report.h"
#include "job/settling.h"
#include "job/simulation_checkpoint.h"
#include "model/clear_starts.h"
#include "model/model.h"
#include "report/report_json.h"
#include "report/report_writer.h"
#include "scene/scene_files.h"
#include "scene/scene_hints.h"
#include "scene/scene_loader.h"
#include "simulate/lifecycle.h"
#include "simulate/simulator.h"
#include "trajectory/trajectory.h"

namespace pilesim {
namespace {

// Steps the simulator through all remaining frames. True if interrupted.
bool simulate_frames(const Scene& scene, const Model& model, uint64_t inspect_every,
                     Simulator& simulator, RunRecorder& recorder, Progress& progress) {
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

Model model_of(const SimulationJob& job, Scene& scene) {
  Model model = naming(job.scene_file.string(), [&] { return build_model(scene); });
  choose_fixed_step(scene, model);
  return model;
}

// A scene that is ready to run. Nothing is written yet.
struct PreparedScene {
  explicit PreparedScene(const SimulationJob& job)
      : loaded(load_scene(job.scene_file, job.overrides)),
        model(model_of(job, loaded.scene)),
        begun_from(job.from ? begin_from(*job.from, loaded.scene, model, job.take) : LastState{}),
        // Before filling the guide changes the numbering of bodies.
        warnings(describe_start_overlaps(model)),
        filling(fill_guide_of(job.scene_file, loaded.scene, model)),
        direction(job.direct_piles ? direction_of(job.scene_file, loaded.scene, model, filling)
                                   : no_direction(loaded.scene, model)) {
    const Scene& scene = loaded.scene;
    std::ranges::copy(scene_hints(scene), std::back_inserter(warnings));
    if (!job.direct_piles && scene.guide) {
      warnings.emplace_back(
          "simulate holds nothing in the scene's \"guide\": pilesim direct-pile does");
    }
    if (!job.direct_piles && !scene.piles.empty()) {
      warnings.emplace_back(
          "simulate steers to no angle of the scene's \"piles\": pilesim direct-pile does");
    }
    if (filling.floats) {
      warnings.emplace_back(
          "the guide is in the air: the bodies in it touch no fixed body, and fall; move it down, "
          "or put a static body below it");
    }
    for (const EmptyPart& part : filling.empty.parts) {
      warnings.push_back("guide: " + describe(part));
    }
    if (std::string line = describe_unkept_signatures(scene, model); !line.empty()) {
      warnings.push_back(std::move(line));
    }
  }
  // The direction refers to the model.
  PreparedScene(const PreparedScene&) = delete;
  PreparedScene& operator=(const PreparedScene&) = delete;

  LoadedScene loaded;
  Model model;
  LastState begun_from;
  std::vector<std::string> warnings;
  GuideFilling filling;
  std::unique_ptr<Direction> direction;
};

SimulationSummary nothing_left(const SimulationJob& job, const Scene& scene) {
  require_whole_run(job.output);
  forget_finishing(job.output);
  SimulationSummary summary{.was_complete = true};
  if (job.picture) summary.warn(put_missing_end_picture(job.output, scene));
  require_gates(job.output, job.gates);
  return summary;
}

// The pile after the last frame, before and after finishing.
struct RunEnd {
  EarlierPlaces earlier;  // of the bodies, so long before that rest can be told from creep
  uint64_t unsettled = 0;
  std::optional<FinishedPile> finished;  // also if it was interrupted
  std::string note;                      // why it is not finished, if the mode would have it so

  bool is_finished() const { return finished && !finished->figures.interrupted; }
};

RunEnd end_run(const SimulationJob& job, const PreparedScene& prepared, const CheckpointKey& key,
               bool is_interrupted, const Simulator& simulator, RunRecorder& recorder) {
  const Scene& scene = prepared.loaded.scene;
  const Model& model = prepared.model;
  RunEnd end;
  const uint64_t last = recorder.progress().rows.size() - 1;
  const auto quiet = static_cast<uint64_t>(quiet_time_s(model, scene.gravity) * scene.frame_rate);
  if (quiet > 0 && quiet <= last) end.earlier = recorder.places_before(last - quiet);
  end.unsettled = count_unsettled(model, scene.gravity, simulator.states(), end.earlier);
  const uint64_t bodies = count_present(model, simulator.states());
  if (is_interrupted || !is_to_be_finished(scene, bodies, end.unsettled, end.note)) return end;
  recorder.write_checkpoint(simulator);
  end.finished = finish_in_place(
      {scene, model, settings_of(scene.finish), job.progress, key, job.checkpoint_period_s},
      job.output);
  return end;
}

// All but the direction's figures and gates.
void complete_report(const PreparedScene& prepared, const Simulator& simulator,
                     RunRecorder& recorder, RunEnd& end, SimulationReport& report) {
  const Scene& scene = prepared.loaded.scene;
  const Model& model = prepared.model;
  recorder.measure_time();
  const RunProgress& progress = recorder.progress();
  report.rows = progress.rows;
  report.inspections = progress.inspections;
  report.frames = report.rows.size();
  report.cpu_s = progress.cpu_s;
  report.checkpoint_s = progress.checkpoint_s;
  const Stopwatch inspection;
  report.quality = end.is_finished()
                       ? inspect_finished(scene, model, *end.finished)
                       : inspect_pile(model, scene.gravity, simulator.states(), end.earlier);
  report.inspection_s = inspection.seconds();
  if (scene.until == Until::settled) {
    report.until =
        Settling(scene, model).figures(report.frames - 1, end.unsettled, progress.quiet_frames);
  }
  report.total_s = progress.wall_s + report.inspection_s;
  report.peak_memory_bytes = peak_memory_bytes();
  report.mode_figures = simulator.figures();
  report.joints = joint_figures(scene, model, simulator.broken_joints(), progress.broke_at);
  const auto note = [&](const std::vector<std::string>& lines) {
    report.notes.insert(report.notes.end(), lines.begin(), lines.end());
  };
  note(simulator.notes());
  if (!end.note.empty()) note({end.note});
  note(simulator.life().stops());
  report.dynamic_bodies -= simulator.life().stopped();
  if (end.is_finished()) take_finish(*end.finished, report);
}

Error interrupted_run(const SimulationJob& job, const Scene& scene, const SimulationReport& report,
                      const RunEnd& end) {
  return {ErrorKind::interrupted,
          Problem{.file = job.output.string(),
                  .found = "interrupted; holds " + std::to_string(report.rows.size()) + " of " +
                           std::to_string(scene.frame_count()) + " frames and their report" +
                           (end.finished ? "; the pile is not finished" : ""),
                  .remedy = "Go on with the same command and --resume"}};
}

// How the run began, in lines for people.
std::vector<std::string> describe_beginning(const SimulationJob& job, const PreparedScene& prepared,
                                            const SimulationReport& report, size_t frames_before) {
  std::vector<std::string> lines;
  const LastState& from = prepared.begun_from;
  if (from.matched > 0) {
    lines.push_back(
        "from " + job.from->string() + ": " + counted(from.matched, "body", "bodies") +
        " begin where they lay" +
        (from.taken > 0 ? ", " + std::to_string(from.taken) + " were taken from the top" : ""));
  }
  if (report.signatures_s > 0) {
    lines.push_back("signatures measured in " + with_digits(report.signatures_s, 3) + " s");
  }
  for (std::string& line : describe_moved_starts(prepared.model)) lines.push_back(line);
  if (frames_before > 0) lines.push_back("resumed after " + counted(frames_before, "frame"));
  return lines;
}

}  // namespace

SimulationSummary run_simulation(const SimulationJob& job) {
  const Stopwatch watch;
  OutputLock lock(job.output);
  const std::optional<RunCheckpoint> checkpoint = job.resume ? find_checkpoint(job) : std::nullopt;
  const auto replaced = checkpoint
                            ? outdated(job.output)
                            : claim_output(job.output, kSimulationEntries, job.force || job.resume);
  PreparedScene prepared(job);
  const Scene& scene = prepared.loaded.scene;
  Model& model = prepared.model;
  const std::string scene_file = job.scene_file.string();
  SimulationReport report = begin_report(job.direct_piles ? "direct-pile" : "simulate",
                                         job.scene_file, prepared.loaded, model);
  const CheckpointKey key{.command = report.command,
                          .program = program_hash(),
                          .scene = report.scene_hash,
                          .start = prepared.begun_from.hash};
  if (checkpoint) checkpoint->require(key);
  report.notes = describe_moved_starts(model);
  for (const std::string& line : prepared.warnings) {
    report.notes.push_back(line);
    if (job.warn) job.warn(line);
  }
  if (checkpoint && checkpoint->is_done()) return nothing_left(job, scene);
  report.signatures_s = naming(scene_file, [&] {
    return measure_signatures(scene, model, {.progress = job.progress, .say = job.warn});
  });
  const std::unique_ptr<Simulator> simulator =
      naming(scene_file, [&] { return prepared.direction->make_simulator(); });
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
  RunRecorder recorder(job.output, job.scene_file, job.checkpoint_period_s, key,
                       make_header(prepared.loaded, report.scene_hash, model), std::move(before),
                       watch);
  try {
    Progress progress(job.progress, "simulate", static_cast<uint64_t>(scene.frame_count()),
                      "frames");
    report.interrupted =
        simulate_frames(scene, model, job.inspect_every, *simulator, recorder, progress);
  } catch (const Error& error) {
    rethrow_with_what_is_safe(in_file(error, scene_file), job.output);
  }
  RunEnd end = end_run(job, prepared, key, report.interrupted, *simulator, recorder);
  if (end.finished) report.interrupted = end.finished->figures.interrupted;
  complete_report(prepared, *simulator, recorder, end, report);
  DirectedRun directed = prepared.direction->finish(*simulator, job.output);
  report.piles = std::move(directed.figures);
  report.gates = judge(job.gates, report.quality, directed.guide);
  const std::string no_charts = write_report(report, job.output);
  // Written last: a process killed before continues from the previous checkpoint.
  if (!report.interrupted) {
    recorder.write_end(end.is_finished() ? end.finished->states : simulator->states());
    forget_finishing(job.output);
  }
  const std::string no_picture = job.picture ? put_end_picture(job.output, scene) : "";

  if (report.interrupted) throw interrupted_run(job, scene, report, end);
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
                            .beginning = describe_beginning(job, prepared, report, frames_before),
                            .piles = std::move(directed.lines),
                            .signatures = report.signatures};
  for (const std::string& line : simulator->life().stops()) summary.beginning.push_back(line);
  if (end.is_finished()) {
    if (end.finished->steps_before > 0) summary.beginning.push_back(resumed_after(*end.finished));
    summary.piles.push_back(describe(end.finished->figures));
  }
  summary.warn(no_charts);
  summary.warn(no_picture);
  for (const std::string& note : simulator->notes()) summary.warn(note);
  summary.warn(end.note);
  if (!report.inspections.empty()) summary.deepest_inspected = deepest_of(report.inspections);
  return summary;
}

}  // namespace pilesim
