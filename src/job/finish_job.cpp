#include "job/finish_job.h"

#include <algorithm>

#include "core/clock.h"
#include "core/counted.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/interrupt.h"
#include "core/output_directory.h"
#include "inspect/pile_inspection.h"
#include "job/end_picture.h"
#include "job/finish_stage.h"
#include "job/last_state.h"
#include "job/run_model.h"
#include "job/run_report.h"
#include "job/simulation_checkpoint.h"
#include "report/report_json.h"
#include "report/report_writer.h"
#include "trajectory/trajectory.h"

namespace pilesim {
namespace {

namespace fs = std::filesystem;

void require_another_directory(const FinishJob& job) {
  std::error_code missing;
  if (!fs::equivalent(job.input, job.output, missing)) return;
  throw Error(ErrorKind::usage, Problem{.file = job.output.string(),
                                        .found = "is the run that is to be finished",
                                        .remedy = "Name another directory with -o"});
}

std::vector<FrameRow> rows_of(const std::vector<FrameStatistics>& steps, uint32_t bodies) {
  std::vector<FrameRow> rows = {{.bodies = bodies}};
  double time_s = 0;
  for (const FrameStatistics& step : steps) {
    time_s += step.times.total_s;
    rows.push_back(make_row(rows.size(), time_s, step, bodies));
  }
  return rows;
}

void inspect_frames(const FinishJob& job, const LoadedScene& loaded, const Model& model,
                    SimulationReport& report) {
  if (job.inspect_every == 0) return;
  TrajectoryReader trajectory(job.output);
  for (uint64_t i = 0; i < trajectory.frame_count(); i += job.inspect_every) {
    report.inspections.push_back(
        {i, inspect_pile(model, loaded.scene.gravity,
                         states_at(trajectory, i, model, job.output.string()))});
  }
}

[[noreturn]] void throw_interrupted(const FinishJob& job, const FinishFigures& figures,
                                    uint64_t frames) {
  throw Error(ErrorKind::interrupted,
              Problem{.file = job.output.string(),
                      .found = "interrupted; holds " + counted(frames, "frame") + ", and " +
                               std::to_string(figures.bodies - figures.not_at_rest) + " of " +
                               counted(figures.bodies, "body", "bodies") + " are at rest",
                      .remedy = "Go on with the same command and --resume"});
}

// The work depends on the input run and on the settings of finishing.
CheckpointKey key_of(const std::string& scene_hash, const TrajectoryReader& source,
                     const BodyStates& start, const RestSettings& settings) {
  StateWriter writer;
  writer(scene_hash, source.frame_count(), start, settings);
  return {.command = "finish", .program = program_hash(), .scene = content_hash(writer.bytes())};
}

// True if the output is already complete for this work. Throws Error(usage) for results without a
// state to resume from, Error(input) for those of other work.
bool is_complete(const FinishJob& job, const std::vector<fs::path>& there,
                 const CheckpointKey& key) {
  const auto is_there = [&](const char* name) {
    return std::ranges::find(there, job.output / name) != there.end();
  };
  if (there.empty() || is_there(kFinishingFile)) return false;
  if (!is_there(kCheckpointFile)) throw_nothing_to_resume(job.output);
  RunCheckpoint(job.output).require(key);
  return true;
}

}  // namespace

SimulationSummary run_finish(const FinishJob& job) {
  const Stopwatch watch;
  const double cpu_before_s = process_cpu_s();
  OutputLock lock(job.output);
  auto replaced = claim_output(job.output, kSimulationEntries, job.force || job.resume);
  require_another_directory(job);
  TrajectoryReader source(job.input);
  const auto [scene_file, loaded, model] =
      load_run_model(job.input, source.header(), job.scene_file);
  const BodyStates start = last_states(source, model, job.input.string());
  SimulationReport report = begin_report("finish", scene_file, loaded, model);

  // The scene's settings, unless the command line overrides them.
  RestSettings settings = settings_of(loaded.scene.finish);
  if (job.longest_s) settings.longest_s = job.longest_s;
  settings.visible_only |= job.visible_only;
  const CheckpointKey key = key_of(report.scene_hash, source, start, settings);
  if (job.resume) {
    if (is_complete(job, replaced, key)) {
      require_whole_run(job.output);
      SimulationSummary nothing_left{.was_complete = true};
      if (job.picture) nothing_left.warn(put_missing_end_picture(job.output, loaded.scene));
      require_gates(job.output, job.gates);
      return nothing_left;
    }
    std::erase(replaced, job.output / kFinishingFile);
  }
  report.setup_s = watch.seconds();

  install_interrupt_handler();
  lock.make_directory();
  remove_output(replaced);
  uint64_t frames = 0;
  FinishedPile pile =
      finish_trajectory({loaded.scene, model, settings, job.progress, key, job.checkpoint_period_s},
                        job.input, start, job.output, "trajectory.zarr", frames);
  const Stopwatch inspection;
  report.quality = inspect_finished(loaded.scene, model, pile);
  inspect_frames(job, loaded, model, report);
  report.inspection_s = inspection.seconds();
  report.frames = frames;
  report.rows.emplace_back();
  take_finish(pile, report);
  report.rows = rows_of(pile.steps, count_present(model, pile.states));
  report.interrupted = pile.figures.interrupted;
  report.gates = judge(job.gates, report.quality);
  report.cpu_s = process_cpu_s() - cpu_before_s;
  report.total_s = watch.seconds();
  report.peak_memory_bytes = peak_memory_bytes();
  TimingCsv timing(job.output / "timing.csv");
  for (const FrameRow& row : report.rows) timing.append(row);
  const std::string no_charts = write_report(report, job.output);
  write_last_states(job.output, key, scene_file, pile.states);
  if (!report.interrupted) forget_finishing(job.output);
  const std::string no_picture = job.picture ? put_end_picture(job.output, loaded.scene) : "";

  if (report.interrupted) throw_interrupted(job, pile.figures, frames);
  throw_failed_gates(job.output, report.gates);
  SimulationSummary summary{
      .frames = frames,
      .bodies = report.dynamic_bodies,
      .static_bodies = report.static_bodies,
      .kinematic_bodies = report.kinematic_bodies,
      .simulated_s = static_cast<double>(frames - 1) / source.header().frame_rate,
      .wall_s = report.total_s,
      .quality = report.quality,
      .collision_shapes = report.collision_shapes};
  if (pile.steps_before > 0) summary.beginning.push_back(resumed_after(pile));
  summary.piles.push_back(describe(pile.figures));
  summary.warn(no_charts);
  summary.warn(no_picture);
  summary.frame_rate = report.frame_rate;
  if (!report.inspections.empty()) summary.deepest_inspected = deepest_of(report.inspections);
  return summary;
}

}  // namespace pilesim
