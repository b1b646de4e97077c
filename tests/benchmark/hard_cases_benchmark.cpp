// Runs the scenes of presets/hard in every applicable way, at three step sizes or at one: in each
// mode, and under both directors. docs/hard_cases.md describes the ways.
//   hard_cases_benchmark [--engine exact|bullet] [--step HZ|auto] [--way WAY] [NAME...]
// Prints a table of passes, and failed criteria with their figures. A pass requires that
// - all values are finite;
// - the energy never exceeds its start, except for the lift that the removal of overlaps causes;
// - momentum is conserved where nothing takes it;
// - nothing passes through a wall or the ground;
// - penetration at the end stays below the case's bound;
// - bodies stand or rest at the end if the case says so;
// - repeating the run gives the same bytes (at 1/60 s).
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/hash.h"
#include "core/text.h"
#include "geometry/mesh.h"
#include "geometry/obj_writer.h"
#include "geometry/primitives.h"
#include "inspect/pile_inspection.h"
#include "job/measured_signatures.h"
#include "pile/guide/guided_simulator.h"
#include "pile/repose/repose_director.h"
#include "report/machine_info.h"
#include "report_errors.h"
#include "scene/scene_loader.h"
#include "simulate/modes/make_simulator.h"
#include "simulate/simulator.h"

namespace pilesim {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr double kNone = std::numeric_limits<double>::infinity();
constexpr double kSteps[] = {0, 1.0 / 60, 1.0 / 15};  // s; 0: automatic

enum class Way { impulse, statistical, particle, mixed, near_all, repose, freeze, nail, glue };

struct WaySettings {
  Way way;
  std::string name;
  std::string mode;
  std::vector<std::string> set = {};  // further overrides of the scene
};

const std::vector<WaySettings> kWays = {
    {Way::impulse, "impulse", "impulse"},
    {Way::statistical, "statistical", "statistical"},
    {Way::particle, "particle", "particle"},
    // Static bodies are must-impulse (unless the case chooses others): bodies near them are solved.
    {Way::mixed, "mixed", "mixed"},
    // All bodies are so near the camera that they are solved: every body is in both engines.
    {Way::near_all,
     "mixed, all near",
     "mixed",
     {R"(/simulator/level_of_detail={"levels": [{"near_near": "impulse", "near_far": "particle",)"
      R"( "far_far": "particle", "exact": true}]})"}},
    {Way::repose, "repose", "impulse", {R"(/piles=[{"angle_deg": 30}])"}},
    {Way::freeze, "freeze", "impulse", {R"(/guide={"hold": "freeze"})"}},
    {Way::nail, "nail", "impulse", {R"(/guide={"hold": "nail"})"}},
    {Way::glue, "glue", "impulse", {R"(/guide={"hold": "glue"})"}},
};

struct Case {
  std::string name;
  double most_penetration = 0.02;  // D, at the end
  bool rests = true;
  double most_drift = kNone;   // D, of any body from its start
  double energy_slack = 0.05;  // in m g D per body, if there is gravity
  bool keeps_momentum = false;
  std::optional<Bounds> wall = {};  // m: a body that passes from its low to its high x gets through
  // All except Way::impulse and Way::near_all, which every case runs.
  std::vector<Way> ways = {};
  std::vector<std::string> mixed_set = {};  // further overrides for Way::mixed
};

const std::vector<Way> kSpheres = {Way::statistical, Way::particle, Way::mixed};
const std::vector<Way> kPile = {Way::statistical, Way::particle, Way::mixed, Way::repose};
const std::vector<Way> kStructure = {Way::freeze, Way::nail, Way::glue};
const std::string kGroundIsExact = "/bodies/0/preference=must_impulse";

const std::vector<Case> kCases = {
    // As blocks, which support each other while they sleep (docs/mixed.md).
    {.name = "tower",
     .most_drift = 0.05,
     .ways = {Way::mixed, Way::freeze, Way::nail, Way::glue},
     .mixed_set = {kGroundIsExact, "/simulator/sleeping=true", "/emitters/0/asleep=true",
                   R"(/shapes/box={"type": "mesh", "file": "../../assets/box.obj"})",
                   R"(/materials/stone={"restitution": 0.2, "friction": 0.5})"}},
    {.name = "iron_on_gravel"},
    {.name = "heavy_on_light", .most_drift = 0.05, .ways = kStructure},
    {.name = "pyramid", .most_drift = 0.05, .ways = kStructure},
    {.name = "card_house", .most_drift = 0.05, .ways = kStructure},
    {.name = "needles", .ways = {Way::repose}},
    {.name = "plates", .ways = {Way::repose}},
    {.name = "millimetres_and_100_m"},
    {.name = "thin_wall",
     .rests = false,
     .wall = Bounds(Vec3(0, 0, -10), Vec3(0.02, 20, 10)),
     .ways = kSpheres,
     .mixed_set = {kGroundIsExact, "/bodies/1/preference=must_impulse"}},
    {.name = "spinning", .rests = false, .ways = kSpheres, .mixed_set = {kGroundIsExact}},
    {.name = "overlapping", .energy_slack = 5, .ways = kPile, .mixed_set = {kGroundIsExact}},
    {.name = "restitution", .rests = false, .ways = {Way::particle}},
    {.name = "friction_0", .rests = false},
    {.name = "friction_2", .most_drift = 0.05, .ways = kStructure},
    {.name = "arch", .most_drift = 0.05, .ways = kStructure},
    {.name = "rings", .rests = false, .most_drift = 1.5},
    {.name = "spikes_and_wedges"},
    {.name = "million_triangles", .ways = {Way::particle, Way::repose}},
    {.name = "contact_on_edge"},
    // Half of them are nearer to the camera, and solved.
    {.name = "zero_gravity",
     .most_penetration = 0.05,
     .rests = false,
     .keeps_momentum = true,
     .ways = kSpheres,
     .mixed_set =
         {R"(/simulator/level_of_detail={"levels": [{"near_near": "impulse", "exact": true},)"
          R"( {}], "distances_m": [11]})"}},
    {.name = "funnel",
     .ways = kPile,
     .mixed_set = {kGroundIsExact, "/bodies/1/preference=must_impulse"}},
    {.name = "resting", .ways = kSpheres, .mixed_set = {kGroundIsExact}},
};

bool applies(const Case& one, Way way) {
  return way == Way::impulse || way == Way::near_all ||
         std::ranges::find(one.ways, way) != one.ways.end();
}

struct Outcome {
  double wall_s = 0;
  PileQuality quality;
  double drift = 0;            // D
  double energy_excess = 0;    // relative to the initial kinetic energy and m g D per body
  double momentum_change = 0;  // relative to the sum of the bodies' initial momenta
  uint64_t through = 0;
  uint32_t awake = 0;
  std::string hash;
  std::string fault;  // the error thrown
};

Vec3 momentum(const Model& model, const BodyStates& states, double& sum) {
  Vec3 total = Vec3::Zero();
  for (size_t i = 0; i < states.size(); ++i) {
    total += model.bodies[i].mass_kg * states.linear_velocity[i];
    sum += model.bodies[i].mass_kg * states.linear_velocity[i].norm();
  }
  return total;
}

std::string hash_of(const BodyStates& states) {
  Hasher hasher;
  hasher.add_values(std::span<const Vec3>(states.position));
  hasher.add_values(std::span<const Vec3>(states.linear_velocity));
  hasher.add_values(std::span<const Vec3>(states.angular_velocity));
  return hasher.digest();
}

// Does not count bodies that go round it.
uint64_t passed(const Bounds& wall, const std::vector<Vec3>& before,
                const std::vector<Vec3>& after) {
  uint64_t count = 0;
  for (size_t i = 0; i < after.size(); ++i) {
    if (before[i].x() > wall.min().x() || after[i].x() < wall.max().x()) continue;
    const double share = (wall.center().x() - before[i].x()) / (after[i].x() - before[i].x());
    if (wall.contains(Vec3(before[i] + share * (after[i] - before[i])))) ++count;
  }
  return count;
}

void judge_motion(const Model& model, const BodyStates& start, const BodyStates& end,
                  Outcome& outcome) {
  const double diameter = outcome.quality.body_diameter_m;
  for (size_t i = 0; i < end.size(); ++i) {
    if (model.bodies[i].role != Role::dynamic) continue;
    outcome.drift =
        std::max(outcome.drift, (end.position[i] - start.position[i]).norm() / diameter);
  }
  double sum = 0, unused = 0;
  const Vec3 before = momentum(model, start, sum);
  outcome.momentum_change = sum > 0 ? (momentum(model, end, unused) - before).norm() / sum : 0;
}

// A scene with piles or a guide runs under its director, which must outlive the simulator.
struct Run {
  Run(const Scene& scene, const Model& model) {
    if (!scene.piles.empty()) {
      director = std::make_unique<ReposeDirector>(scene, model);
      simulator = make_directed_simulator(scene, model, *director);
    } else if (scene.guide) {
      simulator = std::make_unique<GuidedSimulator>(scene, model);
    } else {
      simulator = make_simulator(scene, model);
    }
  }
  std::unique_ptr<ReposeDirector> director;
  std::unique_ptr<Simulator> simulator;
};

Outcome run(const Case& one, const LoadedScene& loaded) {
  Outcome outcome;
  const Scene& scene = loaded.scene;
  Model model = build_model(scene);
  measure_signatures(scene, model, {});
  const Clock::time_point start_time = Clock::now();
  try {
    const Run run(scene, model);
    const std::unique_ptr<Simulator>& simulator = run.simulator;
    const BodyStates start = simulator->states();
    FrameStatistics statistics = simulator->statistics();
    outcome.quality = inspect_pile(model, scene.gravity, start);
    double scale = statistics.kinetic_energy_j;
    double weight = 0;  // m g D of all bodies
    for (const ModelBody& body : model.bodies) {
      weight += body.mass_kg * scene.gravity.norm() * outcome.quality.body_diameter_m;
    }
    scale += weight;
    const double first = statistics.kinetic_energy_j + statistics.potential_energy_j;
    for (int frame = 1; frame < scene.frame_count(); ++frame) {
      const std::vector<Vec3> before = simulator->states().position;
      statistics = simulator->step_frame();
      if (one.wall) outcome.through += passed(*one.wall, before, simulator->states().position);
      const double energy = statistics.kinetic_energy_j + statistics.potential_energy_j;
      outcome.energy_excess =
          std::max(outcome.energy_excess, (energy - first - one.energy_slack * weight) / scale);
    }
    outcome.awake = statistics.bodies_awake;
    outcome.wall_s = std::chrono::duration<double>(Clock::now() - start_time).count();
    outcome.quality = inspect_pile(model, scene.gravity, simulator->states());
    outcome.hash = hash_of(simulator->states());
    judge_motion(model, start, simulator->states(), outcome);
  } catch (const Error& error) {
    outcome.fault = error.what();
  }
  return outcome;
}

// Failed criteria with their figures; empty if all passed. Contacts are solved in single precision.
constexpr double kMostMomentumChange = 1e-5;

std::string verdict(const Case& one, const Outcome& outcome) {
  if (!outcome.fault.empty()) return outcome.fault;
  std::string failed;
  const auto require = [&](bool met, const std::string& what, double figure) {
    if (!met) failed += (failed.empty() ? "" : ", ") + what + " " + with_digits(figure, 2);
  };
  const PileQuality& quality = outcome.quality;
  const auto count = [](uint64_t bodies) { return static_cast<double>(bodies); };
  const double penetration = quality.deepest_penetration_m / quality.body_diameter_m;
  require(penetration <= one.most_penetration, "penetration", penetration);
  require(quality.escaped == 0, "escaped", count(quality.escaped));
  require(outcome.through == 0, "through the wall", count(outcome.through));
  require(outcome.energy_excess <= 1e-3, "energy", outcome.energy_excess);
  require(!one.rests || quality.unsettled == 0, "unsettled", count(quality.unsettled));
  require(!one.rests || quality.floating == 0, "floating", count(quality.floating));
  require(outcome.drift <= one.most_drift, "moved", outcome.drift);
  require(!one.keeps_momentum || outcome.momentum_change < kMostMomentumChange, "momentum",
          outcome.momentum_change);
  return failed;
}

// A ball of 1.3 million triangles with bumps, written where the following scene expects it.
fs::path write_million_triangles(const fs::path& directory) {
  TriangleMesh ball = sphere_mesh(0.1, 8);
  for (Vec3& v : ball.vertices) {
    v *= 1 + 0.03 * std::sin(70 * v.x()) * std::sin(60 * v.y()) * std::sin(50 * v.z());
  }
  write_obj(ball, directory / "million_triangles.obj");
  fs::path scene = directory / "million_triangles.json";
  FILE* file = std::fopen(scene.c_str(), "w");
  std::fputs(R"({"version": 1, "duration_s": 4, "materials": {"stone": {"friction": 0.7}},
    "shapes": {"ground": {"type": "plane"}, "ball": {"type": "mesh", "file": "million_triangles.obj"}},
    "bodies": [{"shape": "ground", "material": "stone", "role": "static"}],
    "emitters": [{"type": "grid", "shape": "ball", "material": "stone", "centre": [0, 0.5, 0],
                  "count": [2, 2, 2], "spacing": [0.22, 0.22, 0.22]}]})",
             file);
  std::fclose(file);
  return scene;
}

struct Result {
  std::string failed;  // empty: a pass
  double wall_s = 0;
};

Result run_way(const Case& one, const WaySettings& way, const fs::path& scene,
               const std::string& engine, double step_s) {
  char step[40];
  std::snprintf(step, sizeof step, step_s > 0 ? "/step_s=%.17g" : "/step_s=\"auto\"", step_s);
  std::vector<std::string> set = {"/simulator/mode=" + way.mode, "/simulator/engine=" + engine,
                                  step, "/frame_rate=15"};
  set.insert(set.end(), way.set.begin(), way.set.end());
  if (way.way == Way::mixed) set.insert(set.end(), one.mixed_set.begin(), one.mixed_set.end());
  const LoadedScene loaded = load_scene(scene, set);
  const Outcome outcome = run(one, loaded);
  // Rounding: spheres move in single precision.
  Result result{verdict(one, outcome), outcome.wall_s};
  if (result.failed.empty() && step_s == kSteps[1] && run(one, loaded).hash != outcome.hash) {
    result.failed = "not the same bytes twice";
  }
  return result;
}

void run_case(const Case& one, std::span<const WaySettings> ways, const std::string& engine,
              std::span<const double> steps, const fs::path& scratch) {
  const fs::path scene = one.name == "million_triangles"
                             ? write_million_triangles(scratch)
                             : fs::path(PILESIM_SOURCE_DIR "/presets/hard") / (one.name + ".json");
  for (const WaySettings& way : ways) {
    if (!applies(one, way.way) || (engine == "bullet" && way.way != Way::impulse)) continue;
    std::string walls;
    std::printf("| %s | %s |", one.name.c_str(), way.name.c_str());
    for (const double step_s : steps) {
      const Result result = run_way(one, way, scene, engine, step_s);
      std::printf(" %s |", result.failed.empty() ? "pass" : result.failed.c_str());
      char wall[40];
      std::snprintf(wall, sizeof wall, "%s%.1f", walls.empty() ? "" : ", ", result.wall_s);
      walls += wall;
      std::fflush(stdout);
    }
    std::printf(" %s |\n", walls.c_str());
    std::fflush(stdout);
  }
}

void run_all(int argc, char** argv) {
  const MachineInfo machine = machine_info();
  std::printf("%s, %s\n\n", machine.cpu.c_str(), machine.system.c_str());
  // Several processes may run at once.
  const fs::path scratch =
      fs::temp_directory_path() / ("pilesim_hard_cases." + std::to_string(getpid()));
  fs::create_directories(scratch);
  std::vector<std::string> names(argv + 1, argv + argc);
  const auto take = [&](const std::string& option) -> std::optional<std::string> {
    const auto given = std::ranges::find(names, option);
    if (given == names.end() || given + 1 == names.end()) return std::nullopt;
    const std::string value = given[1];
    names.erase(given, given + 2);
    return value;
  };
  const std::string engine = take("--engine").value_or("exact");
  std::vector<double> steps(std::begin(kSteps), std::end(kSteps));
  if (const auto hz = take("--step")) steps = {*hz == "auto" ? 0 : 1 / std::stod(*hz)};
  std::vector<WaySettings> ways = kWays;
  if (const auto name = take("--way")) {
    std::erase_if(ways, [&](const WaySettings& way) { return way.name != *name; });
    if (ways.empty()) throw Error(ErrorKind::usage, {.found = "'" + *name + "' is no way"});
  }
  for (const std::string& name : names) {
    if (std::ranges::find(kCases, name, &Case::name) != kCases.end()) continue;
    throw Error(ErrorKind::usage, {.found = "'" + name + "' is no hard case"});
  }
  std::printf("| Case | Way |");
  std::string rule = "|---|---|";
  for (const double step_s : steps) {
    step_s > 0 ? std::printf(" 1/%.0f s |", 1 / step_s) : std::printf(" automatic |");
    rule += "---|";
  }
  std::printf(" Wall, s |\n%s---|\n", rule.c_str());
  for (const Case& one : kCases) {
    const bool wanted = names.empty() || std::ranges::find(names, one.name) != names.end();
    if (wanted) run_case(one, ways, engine, steps, scratch);
  }
  fs::remove_all(scratch);
}

}  // namespace
}  // namespace pilesim

int main(int argc, char** argv) {
  return pilesim::report_errors([&] { pilesim::run_all(argc, argv); });
}
