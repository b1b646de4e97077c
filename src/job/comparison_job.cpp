#include "job/comparison_job.h"

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/interrupt.h"
#include "core/naming.h"
#include "core/output_directory.h"
#include "core/parallel_for.h"
#include "core/temporary_file.h"
#include "inspect/pile_inspection.h"
#include "job/child_run.h"
#include "job/end_picture.h"
#include "job/measured_signatures.h"
#include "job/mode_spec.h"
#include "json/json_text.h"
#include "model/model.h"
#include "pile/guide/upside_down.h"
#include "report/comparison_writer.h"
#include "report/html.h"
#include "report/report_json.h"
#include "scene/overrides.h"
#include "scene/scene_files.h"
#include "scene/scene_loader.h"
#include "simulate/modes/make_simulator.h"
#include "simulate/simulator.h"
#include "trajectory/trajectory.h"

namespace pilesim {
namespace {

namespace fs = std::filesystem;

constexpr char kRuns[] = "runs";
constexpr char kKeyFile[] = "finished.key";

struct PlannedRun {
  const ModeSpec* mode;
  uint64_t seed;
  fs::path directory;
  std::vector<std::string> overrides;
  std::string key;  // hash of everything its result depends on
};

struct Plan {
  LoadedScene scene;             // with the job's overrides, in the scene's own mode
  std::vector<ModeSpec> modes;   // the reference first
  std::vector<PlannedRun> runs;  // ordered by seed
  Scene reference_scene;
  std::string warning;  // empty: none
};

std::vector<std::string> joined(std::vector<std::string> first,
                                const std::vector<std::string>& second) {
  first.insert(first.end(), second.begin(), second.end());
  return first;
}

// Depends on everything that affects the result of a run: the program, the scene, its files.
std::string run_key(const std::string& program_hash, const LoadedScene& loaded) {
  return content_hash(program_hash + scene_hash(loaded));
}

std::vector<ModeSpec> resolve_modes(const ComparisonJob& job, const Scene& scene) {
  const std::string reference = !job.reference.empty()          ? job.reference
                                : dynamic_meshes(scene).empty() ? "impulse"
                                                                : "impulse:decomposition";
  std::vector<ModeSpec> modes = {resolve_mode(reference, scene)};
  for (const std::string& name : split_modes(job.modes)) {
    if (name == reference) continue;
    modes.push_back(resolve_mode(name, scene));
  }
  std::set<std::string> directories;
  for (const ModeSpec& mode : modes) {
    if (!directories.insert(mode.directory).second) {
      throw Error(ErrorKind::usage, Problem{.file = "mode \"" + mode.name + '"',
                                            .found = "is given twice",
                                            .expected = "each mode once"});
    }
  }
  return modes;
}

// Throws errors that the run would throw at its start, such as a mode with another mesh's
// signature. Measures the signatures that the run needs, so that each run finds them in the cache.
// If there is no cache, the returned text says so.
std::string require_simulator(const Scene& scene, const ComparisonJob& job) {
  Model model = build_model(scene);
  fill_guide(scene, model);
  std::string unkept = describe_unkept_signatures(scene, model);
  if (unkept.empty()) {
    measure_signatures(scene, model, {.progress = job.progress, .say = job.warn});
  } else {
    find_signatures(scene, model);
  }
  make_simulator(scene, model);
  return unkept;
}

// Errors in a mode's overrides name the mode, since the user has not written the overrides.
LoadedScene load_in_mode(const ComparisonJob& job, const ModeSpec& mode,
                         const std::vector<std::string>& overrides) {
  try {
    return load_scene(job.scene_file, overrides);
  } catch (const Error& error) {
    std::vector<Problem> problems = error.problems();
    for (Problem& problem : problems) {
      for (const std::string& own : mode.overrides) {
        if (problem.file != parse_override(own).place()) continue;
        problem.file = "mode \"" + mode.name + '"';
        if (problem.pointer.empty()) problem.pointer = parse_override(own).pointer;
      }
    }
    throw Error(error.kind(), std::move(problems));
  }
}

Plan make_plan(const ComparisonJob& job) {
  if (job.scene_file == kStandardInput) {
    throw Error(ErrorKind::usage, Problem{.file = "-",
                                          .found = "is standard input, which only one run can read",
                                          .expected = "a scene file: each mode reads it"});
  }
  Plan plan;
  plan.scene = load_scene(job.scene_file, job.overrides);
  plan.modes = resolve_modes(job, plan.scene.scene);
  const uint64_t last_first = UINT64_MAX - static_cast<uint64_t>(job.runs - 1);
  if (plan.scene.scene.seed > last_first) {
    throw Error(ErrorKind::usage,
                Problem{.file = job.scene_file.string(),
                        .pointer = "/seed",
                        .found = "is " + std::to_string(plan.scene.scene.seed),
                        .expected = "at most " + std::to_string(last_first) + ", as each of " +
                                    std::to_string(job.runs) + " runs takes the next one"});
  }
  const std::string program_hash = content_hash(read_file(job.program));
  for (int i = 0; i < job.runs; ++i) {
    const uint64_t seed = plan.scene.scene.seed + static_cast<uint64_t>(i);
    for (const ModeSpec& mode : plan.modes) {
      PlannedRun run{.mode = &mode, .seed = seed};
      run.directory = job.output / kRuns / mode.directory / ("seed" + std::to_string(seed));
      run.overrides = joined(job.overrides, mode.overrides);
      run.overrides.push_back("/seed=" + std::to_string(seed));
      const LoadedScene loaded = load_in_mode(job, mode, run.overrides);
      if (&mode == &plan.modes[0]) plan.reference_scene = loaded.scene;
      // Each seed may sample other materials; only the impulse mode needs no signatures for them.
      if (i == 0 || loaded.scene.simulator.mode != SimulatorMode::impulse) {
        std::string unkept =
            naming(job.scene_file.string(), [&] { return require_simulator(loaded.scene, job); });
        if (!unkept.empty()) plan.warning = std::move(unkept);
      }
      run.key = run_key(program_hash, loaded);
      plan.runs.push_back(std::move(run));
    }
  }
  return plan;
}

bool is_finished(const PlannedRun& run) {
  const fs::path key = run.directory / kKeyFile;
  return fs::exists(key) && read_file(key) == run.key;
}

void stop_if_interrupted(const ComparisonJob& job) {
  if (!interrupted()) return;
  throw Error(ErrorKind::interrupted,
              Problem{.file = job.output.string(),
                      .found = "interrupted; the runs that were complete are kept",
                      .remedy = "Go on with the same command and --resume"});
}

void simulate(const ComparisonJob& job, const PlannedRun& run) {
  std::vector<std::string> command = {job.program.string(),
                                      "simulate",
                                      fs::absolute(job.scene_file).string(),
                                      "-o",
                                      run.directory.string(),
                                      "--quiet",
                                      "--force",
                                      "--no-picture",
                                      "--threads",
                                      std::to_string(thread_count())};
  for (const std::string& one : run.overrides) {
    command.push_back("--set");
    command.push_back(one);
  }
  remove_in_one_go(run.directory / kKeyFile);
  run_child(
      command, {},
      {.file = run.directory.string(),
       .found = "mode " + run.mode->name + " with seed " + std::to_string(run.seed) + " failed:"});
  stop_if_interrupted(job);
  write_file_atomically(run.directory / kKeyFile, run.key);
}

void simulate_all(const ComparisonJob& job, const Plan& plan) {
  Progress progress(job.progress, "compare", plan.runs.size(), "runs");
  for (size_t i = 0; i < plan.runs.size(); ++i) {
    if (!job.resume || !is_finished(plan.runs[i])) simulate(job, plan.runs[i]);
    progress.update(i + 1);
  }
}

// The last frame, with velocities from the displacement since the frame before.
BodyStates end_states(TrajectoryReader& trajectory) {
  TrajectoryFrame before, end;
  const uint64_t last = trajectory.frame_count() - 1;
  trajectory.read(last - 1, before);
  trajectory.read(last, end);
  const double rate = trajectory.header().frame_rate;
  BodyStates states;
  states.flags = end.state;
  for (size_t i = 0; i < end.position.size(); ++i) {
    states.position.push_back(end.position[i]);
    states.orientation.push_back(end.orientation[i].cast<double>().normalized());
    states.linear_velocity.push_back(rate * (end.position[i] - before.position[i]));
    const Eigen::AngleAxisd turn(states.orientation[i] *
                                 before.orientation[i].cast<double>().normalized().conjugate());
    states.angular_velocity.push_back(rate * turn.angle() * turn.axis());
  }
  return states;
}

ComparedRun read_run(const ComparisonJob& job, const PlannedRun& run, const ReportedRun& report,
                     const Model& judge_model, const Vec3& gravity, TrajectoryReader& trajectory) {
  ComparedRun result;
  result.seed = run.seed;
  result.simulated_s =
      static_cast<double>(trajectory.frame_count() - 1) / trajectory.header().frame_rate;
  result.setup_s = report.setup_s;
  result.times = report.times;
  result.cpu_s = report.cpu_s;
  result.steps = report.steps;
  result.peak_memory_bytes = report.peak_memory_bytes;
  result.measures = measure_run(trajectory, job.times);
  result.quality = inspect_pile(judge_model, gravity, end_states(trajectory));
  return result;
}

Comparison evaluate(const ComparisonJob& job, const Plan& plan) {
  Comparison comparison;
  comparison.scene_name = plan.scene.scene.name;
  comparison.scene_file = job.scene_file.filename().string();
  comparison.threads = thread_count();
  Model judge_model = build_model(plan.reference_scene);
  fill_guide(plan.reference_scene, judge_model);
  for (const ModelShape& shape : judge_model.shapes) {
    if (shape.collision_report.empty()) continue;
    comparison.judged_by.push_back(shape.name + ": " + shape.collision_report);
  }
  for (const ModeSpec& mode : plan.modes) {
    comparison.modes.push_back({.name = mode.name, .overrides = mode.overrides});
  }
  const size_t mode_count = plan.modes.size();
  for (size_t i = 0; i < plan.runs.size(); ++i) {
    stop_if_interrupted(job);
    const PlannedRun& run = plan.runs[i];
    ComparedMode& mode = comparison.modes[i % mode_count];
    TrajectoryReader trajectory(run.directory);
    // A resumed run may have left its report in any state.
    ReportedRun report = read_report(run.directory / "report.json");
    ComparedRun result =
        read_run(job, run, report, judge_model, plan.reference_scene.gravity, trajectory);
    // The reference's own error is its distance to the reference with the next seed.
    const size_t seed_index = i / mode_count;
    const size_t other = i % mode_count == 0
                             ? (seed_index + 1) % static_cast<size_t>(job.runs) * mode_count
                             : seed_index * mode_count;
    TrajectoryReader reference(plan.runs[other].directory);
    result.motion = motion_error(reference, trajectory);
    if (mode.collision_shapes.empty()) mode.collision_shapes = std::move(report.collision_shapes);
    mode.runs.push_back(std::move(result));
  }
  return comparison;
}

// Adds pictures of the end of each mode's first run.
std::string put_pictures(const Plan& plan, const fs::path& page) {
  std::vector<EndPicture> pictures;
  for (size_t i = 0; i < plan.modes.size(); ++i) {
    pictures.push_back({.run = plan.runs[i].directory, .place = escaped(plan.modes[i].name)});
  }
  return put_end_pictures(page, plan.scene.scene, pictures);
}

ComparisonSummary summarise(const nlohmann::ordered_json& figures) {
  const auto number = [](const nlohmann::ordered_json& value) {
    return value.is_number() ? value.get<double>() : std::numeric_limits<double>::quiet_NaN();
  };
  ComparisonSummary summary;
  for (const auto& mode : figures["modes"]) {
    ComparisonSummary::Line& line = summary.lines.emplace_back();
    line.mode = mode["name"];
    const auto& speed_up = mode["speed_up"];
    line.speed_up = number(speed_up["value"]);
    line.speed_up_low = number(speed_up["low"]);
    line.speed_up_high = number(speed_up["high"]);
    const auto& worst = mode["worst_error"];
    line.error = line.error_low = line.error_high = std::numeric_limits<double>::quiet_NaN();
    if (worst.is_null()) continue;
    line.error = number(worst["value"]);
    line.error_low = number(worst["low"]);
    line.error_high = number(worst["high"]);
    line.quantity = worst["quantity"];
  }
  return summary;
}

}  // namespace

ComparisonSummary run_comparison(const ComparisonJob& job) {
  std::vector<std::string_view> own(std::begin(kComparisonEntries), std::end(kComparisonEntries));
  own.push_back(kRuns);
  OutputLock lock(job.output);
  const auto there = claim_output(job.output, own, job.force || job.resume);
  const Plan plan = make_plan(job);
  install_interrupt_handler();
  // A report must never stand beside runs of another comparison.
  lock.make_directory();
  remove_output(job.resume ? claim_output(job.output, kComparisonEntries, true) : there);
  simulate_all(job, plan);
  const Comparison comparison = evaluate(job, plan);
  const std::string no_charts = write_comparison(comparison, job.output);
  const std::string no_pictures = put_pictures(plan, job.output / "compare.html");
  ComparisonSummary summary = summarise(read_json_file(job.output / "compare.json"));
  for (const std::string& line : {plan.warning, no_charts, no_pictures}) {
    if (!line.empty()) summary.warnings.push_back(line);
  }
  return summary;
}

}  // namespace pilesim
