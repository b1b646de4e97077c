#include "packing/packing_measurement.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <mutex>
#include <vector>

#include "core/error.h"
#include "core/interrupt.h"
#include "core/parallel_for.h"
#include "model/model_shapes.h"
#include "simulate/modes/make_simulator.h"
#include "simulate/sphere/sphere_simulator.h"
#include "simulate/sphere/sphere_world.h"

namespace pilesim {
namespace {

// A Gauss-Newton search on the logarithms of figures and parameters, with slopes that are roughly
// the same for all objects; each iteration has its own starts. Steps shrink from kSureRounds on,
// and the result is the mean of the last iterations, since piles of one seed differ by some per
// cent.
constexpr uint32_t kRounds = 16, kSureRounds = 5, kAveraged = 6;

// The parameters, as logarithms: radius, rolling resistance, turning at impacts, turning against
// walls, and rebound.
constexpr int kOfSought = 5;
using Sought = Eigen::Matrix<double, kOfSought, 1>;

// A figure to match, its weight, and its slopes over the parameters.
struct Target {
  double PackingFigures::*figure;
  double weight;
  std::array<double, kOfSought> slopes;
};
constexpr std::array kTargets = {
    Target{&PackingFigures::heap_height, 1, {1.3, 0.2, -0.1, 0, -0.1}},
    Target{&PackingFigures::heap_spread, 1, {0.3, -0.04, 0, 0, 0.12}},
    Target{&PackingFigures::heap_reach, 1, {0.3, 0, -0.3, 0, 0}},
    Target{&PackingFigures::large_heap_height, 1, {1.5, 0.2, -0.1, 0, -0.07}},
    Target{&PackingFigures::large_heap_spread, 1, {0.3, -0.04, 0, 0, 0.08}},
    Target{&PackingFigures::column_height, 1, {2.7, 0.1, -0.1, 0, 0}},
    Target{&PackingFigures::column_spread, 1, {0, 0, 0, 0.03, 0}},
    Target{&PackingFigures::column_reach, 1, {0.3, 0, -0.3, 0, 0}},
    Target{&PackingFigures::column_fraction, 0.3, {-3.3, -0.1, 0.1, 0, 0}},
    Target{&PackingFigures::dropped, 0.03, {0, 0, 0, 0, 1.5}},
    Target{&PackingFigures::thrown, 0.03, {0, 0, 0, 0, 0.8}},
};
constexpr std::array kMostChange = {0.12, 0.8, 0.5, 0.8, 0.3};  // of the five, in one iteration
constexpr double kLeastRolling = 0.003, kMostRolling = 8;
constexpr double kFirstRadius = 1.1;  // relative to the radius of a ball of the object's volume
constexpr double kLeastRadius = 0.5;  // relative to the first one
constexpr double kFirstRolling = 0.2, kFirstTurning = 1, kFirstLeaning = 0.15;
constexpr double kLeastTurning = 0.01, kMostTurning = 10;
constexpr double kLeastLeaning = 0.003, kMostLeaning = 1;
constexpr double kFirstRebound = 0.8, kLeastRebound = 0.3;
constexpr int kSweeps = 8;  // default of the statistical mode

// First seed of the spheres' pours, beyond all seeds of the exact engine.
constexpr uint64_t kSphereSeeds = 1 << 16;

// A figure that some pours do not give is 0 in both.
struct Spread {
  PackingFigures mean, error;
};

Spread spread_of(const std::vector<PackingFigures>& all) {
  Spread result;
  const auto count = static_cast<double>(all.size());
  for (double PackingFigures::*const figure : kPackingFigures) {
    const auto tells = [&](const PackingFigures& one) { return one.*figure > 0; };
    if (!std::ranges::all_of(all, tells)) continue;
    double& mean = result.mean.*figure;
    for (const PackingFigures& one : all) mean += one.*figure / count;
    double squares = 0;
    for (const PackingFigures& one : all) squares += std::pow(one.*figure - mean, 2);
    if (count > 1) result.error.*figure = std::sqrt(squares / (count * (count - 1)));
  }
  return result;
}

using Trials = std::array<PourTrial, 4>;  // by PourKind

// Makes the simulator of a trial and of the model of its bodies.
using MakeSimulator =
    std::function<std::unique_ptr<Simulator>(const PourTrial& trial, const Model& model)>;

Spread pour(const Trials& trials, uint64_t first_seed, uint32_t pours, const MakeSimulator& make,
            const std::function<void()>& poured) {
  std::vector<PackingFigures> figures(pours);
  parallel_for(trials.size() * pours, 1, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end && !interrupted(); ++i) {
      const size_t pour = i / trials.size();
      const auto kind = static_cast<PourKind>(i % trials.size());
      const PourTrial& trial = trials[i % trials.size()];
      const Model model = trial.starts(first_seed + pour);
      const PourFigures came = trial.run(*make(trial, model));
      PackingFigures& f = figures[pour];
      if (kind == PourKind::heap) {
        f.heap_height = came.height;
        f.heap_spread = came.spread;
        f.heap_reach = came.reach;
        f.time = came.time;
      } else if (kind == PourKind::large_heap) {
        f.large_heap_height = came.height;
        f.large_heap_spread = came.spread;
      } else if (kind == PourKind::alone) {
        f.dropped = came.dropped;
        f.thrown = came.thrown;
      } else {
        f.column_height = came.height;
        f.column_spread = came.spread;
        f.column_reach = came.reach;
        f.column_fraction = came.fraction;
        f.column_deep_fraction = came.deep_fraction;
        f.column_nearest = came.nearest;
      }
      poured();
    }
  });
  if (interrupted()) {
    throw Error(ErrorKind::interrupted,
                Problem{.found = "interrupted while bodies were poured",
                        .remedy = "The same command samples no trial again"});
  }
  return spread_of(figures);
}

// Bounds of the parameters; no radius exceeds `outer_m`, the object's bounding radius.
struct Limits {
  Sought least, most;
};

Limits limits_of(double first_m, double outer_m) {
  return {Sought(kLeastRadius * first_m, kLeastRolling, kLeastTurning, kLeastLeaning, kLeastRebound)
              .array()
              .log(),
          Sought(outer_m, kMostRolling, kMostTurning, kMostLeaning, 1).array().log()};
}

// A parameter at a bound that would cross it stays there, and the others compensate.
Sought step_towards(const PackingFigures& wanted, const PackingFigures& now, const Sought& from,
                    const Limits& limits) {
  Sought free = Sought::Ones();
  while (true) {
    Eigen::Matrix<double, kOfSought, kOfSought> squares;
    squares.setIdentity();
    squares *= 1e-9;
    Sought sum = Sought::Zero();
    for (const Target& target : kTargets) {
      // A figure may be absent, such as the solid share of a column barely higher than a body.
      if (!(wanted.*target.figure > 0 && now.*target.figure > 0)) continue;
      const Sought slopes = free.cwiseProduct(Sought(target.slopes.data()));
      squares += target.weight * slopes * slopes.transpose();
      sum += target.weight * std::log(wanted.*target.figure / now.*target.figure) * slopes;
    }
    Sought step = squares.ldlt().solve(sum);
    bool is_within = true;
    for (int i = 0; i < step.size(); ++i) {
      const bool is_beyond =
          (step[i] < 0 && from[i] <= limits.least[i]) || (step[i] > 0 && from[i] >= limits.most[i]);
      if (free[i] == 0 || !is_beyond) continue;
      free[i] = 0;
      is_within = false;
    }
    if (is_within) return step;
  }
}

Sought moved(const Sought& from, const Sought& step, const Limits& limits) {
  const Sought most(kMostChange.data());
  return (from + step.cwiseMax(-most).cwiseMin(most)).cwiseMax(limits.least).cwiseMin(limits.most);
}

Packing packing_of(const Sought& sought) {
  return {.radius_m = std::exp(sought[0]),
          .rolling = std::exp(sought[1]),
          .turning = std::exp(sought[2]),
          .leaning = std::exp(sought[3]),
          .rebound = std::exp(sought[4])};
}

}  // namespace

PouredObject poured_object(const SignatureOptions& sampling, const Signature& signature) {
  MeshShape mesh{.file = sampling.mesh, .scale = Vec3::Constant(sampling.scale)};
  mesh.up = sampling.is_z_up ? UpAxis::z : UpAxis::y;
  mesh.collision = CollisionKind::decomposition;
  mesh.solid = sampling.solid.rule;
  mesh.thickness_m = sampling.solid.thickness_m;
  mesh.hull_max_vertices = sampling.solid.hull_max_vertices;
  Scene scene;
  scene.shapes["object"] = mesh;
  MeshLibrary meshes;
  return {.shape = build_shape(scene, "object", meshes),
          .material = {.restitution = sampling.material.restitution,
                       .friction = sampling.material.friction},
          .outer_radius_m = signature.body.outer_radius_m,
          .volume_m3 = signature.body.volume_m3};
}

Packing measure_packing(const PouredObject& object, const Signature& signature,
                        const PackingSettings& settings) {
  const Trials trials = {PourTrial(object, PourKind::heap), PourTrial(object, PourKind::large_heap),
                         PourTrial(object, PourKind::column), PourTrial(object, PourKind::alone)};
  const uint32_t a_round = settings.sphere_pours, of_result = 2 * a_round;
  const uint32_t sphere_pours = kRounds * a_round + of_result;
  Progress progress(settings.progress, settings.stage,
                    trials.size() * (settings.pours + sphere_pours), "pours");
  std::mutex progress_mutex;
  uint32_t done = 0;
  const auto poured = [&] {
    const std::lock_guard lock(progress_mutex);
    progress.update(++done);
  };
  const Spread exact = pour(
      trials, settings.seed, settings.pours,
      [](const PourTrial& trial, const Model& model) {
        return make_simulator(trial.scene(), model);
      },
      poured);

  const auto shared = std::make_shared<const Signature>(signature);
  std::array<Scene, std::tuple_size_v<Trials>> scenes;
  for (size_t i = 0; i < trials.size(); ++i) scenes[i] = trials[i].scene();
  for (Scene& scene : scenes) {
    scene.step_s = 1 / scene.frame_rate;
    scene.simulator.mode = SimulatorMode::statistical;
    scene.simulator.solver_iterations = kSweeps;
  }
  const auto pour_spheres = [&](const Sought& sought, uint32_t first, uint32_t pours) {
    const BodySignature body = body_signature(shared, packing_of(sought));
    const auto make = [&](const PourTrial& trial, const Model& model) {
      const ModelBody& poured_body = model.bodies.back();
      BodySignatures objects = {{{poured_body.shape, poured_body.material}, body}};
      return std::make_unique<SphereSimulator<SphereWorld>>(
          scenes[static_cast<size_t>(&trial - trials.data())], model, std::move(objects));
    };
    return pour(trials, settings.seed + kSphereSeeds + first, pours, make, poured);
  };
  const double ball_m = std::cbrt(3 * object.volume_m3 / (4 * kPi));
  const double first_m = std::min(kFirstRadius * ball_m, object.outer_radius_m);
  const Limits limits = limits_of(first_m, object.outer_radius_m);
  Sought sought = Sought(first_m, kFirstRolling, kFirstTurning, kFirstLeaning, kFirstRebound)
                      .array()
                      .log(),
         mean = Sought::Zero();
  for (uint32_t round = 0; round < kRounds; ++round) {
    const double late = round < kSureRounds ? 0 : round - kSureRounds + 1;
    const Spread now = pour_spheres(sought, round * a_round, a_round);
    const Sought step = step_towards(exact.mean, now.mean, sought, limits) / (1 + late / 2);
    sought = moved(sought, step, limits);
    if (round + kAveraged >= kRounds) mean += sought / kAveraged;
  }
  const Spread spheres = pour_spheres(mean, kRounds * a_round, of_result);
  Packing packing = packing_of(mean);
  packing.pours = settings.pours;
  packing.measured = exact.mean;
  packing.error = exact.error;
  packing.spheres = spheres.mean;
  return packing;
}

}  // namespace pilesim
