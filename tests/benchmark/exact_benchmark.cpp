// The impulse mode's engines side by side: time against the quality of their piles.
//   exact_benchmark [--hulls N | --rabbits N | --balls N | --sleepers N] [--step HZ] [--frames N]
//                   [--threads N] [--every N] [--mesh FILE] [ENGINE...]
// Bodies fall in a cubic grid onto a plane, in frames of 1/60 s: hulls of 40 vertices, 2 m across;
// rabbits of 0.4 m with 6 pieces; or balls of 0.2 m. Sleepers are boxes asleep side by side, while
// one box slides away from them without friction. Engines: exact, bullet. Overlaps come from
// inspect_pile() in every Nth frame, for the largest of the run (0: only at the end). Inspection is
// not timed.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/parallel_for.h"
#include "geometry/convex_hull.h"
#include "geometry/mesh_import.h"
#include "inspect/pile_inspection.h"
#include "model/model_shapes.h"
#include "report/machine_info.h"
#include "report_errors.h"
#include "simulate/modes/make_simulator.h"
#include "support/small_model.h"

namespace pilesim {
namespace {

using Clock = std::chrono::steady_clock;

struct Options {
  int bodies = 1000, step_hz = 60, frames = 420, every = 10;
  bool rabbits = false, balls = false, sleepers = false;
  std::string mesh = std::string(PILESIM_SOURCE_DIR) + "/assets/rabbit.obj";
  std::vector<std::string> engines;
};

ModelShape hull_shape(const std::string& file) {
  constexpr int kVertices = 40;
  ModelShape shape;
  shape.name = file;
  shape.mesh = simplified_hull(import_mesh(file).vertices, kVertices);
  const Vec3 centre = mass_properties(shape.mesh).centre_of_mass;
  double radius = 0;
  for (Vec3& vertex : shape.mesh.vertices) radius = std::max(radius, (vertex -= centre).norm());
  for (Vec3& vertex : shape.mesh.vertices) vertex *= 1 / radius;
  shape.mass = mass_properties(shape.mesh);
  shape.bounding_radius = 1;
  shape.smallest_extent = shape.mesh.bounds().sizes().minCoeff();
  shape.pieces.push_back({CollisionPiece::Kind::hull, {}, {}, shape.mesh});
  return shape;
}

// 0.4 m long, in six convex pieces.
ModelShape rabbit_shape(const std::string& file) {
  const TriangleMesh mesh = import_mesh(file);
  const double scale = 0.4 / mesh.bounds().sizes().maxCoeff();
  Scene scene;
  MeshShape source;
  source.file = file;
  source.scale = Vec3::Constant(scale);
  source.collision = CollisionKind::decomposition;
  source.decomposition_max_pieces = 6;
  scene.shapes["rabbit"] = source;
  MeshLibrary meshes;
  return build_shape(scene, "rabbit", meshes);
}

SmallModel pile(const Options& options) {
  SmallModel m;
  m.scene.frame_rate = 60;
  if (options.step_hz > 0) m.scene.step_s = 1.0 / options.step_hz;
  const uint32_t material = m.material(0.1, 0.5);
  m.body(m.plane(), material, Vec3::Zero(), Role::fixed);
  if (options.balls) {
    m.sphere(0.1);
  } else {
    m.model.shapes.push_back(options.rabbits ? rabbit_shape(options.mesh)
                                             : hull_shape(options.mesh));
  }
  const auto index = static_cast<uint32_t>(m.model.shapes.size() - 1);
  const double diameter = 2 * m.model.shapes.back().bounding_radius;
  const int side = static_cast<int>(std::ceil(std::cbrt(options.bodies)));
  for (int i = 0; i < options.bodies; ++i) {
    const Vec3 cell(i % side, i / (side * side), i / side % side);
    const Quat turn(Eigen::AngleAxisd(0.7 * i, Vec3(std::sin(i), std::cos(i), 0.5).normalized()));
    m.body(index, material, diameter * 1.1 * (cell + Vec3(0, 1, 0))).pose.orientation = turn;
  }
  return m;
}

SmallModel sleepers(const Options& options) {
  SmallModel m;
  m.scene.frame_rate = 60;
  if (options.step_hz > 0) m.scene.step_s = 1.0 / options.step_hz;
  const uint32_t smooth = m.material(0, 0), rough = m.material(0, 0.5);
  m.body(m.plane(), smooth, Vec3::Zero(), Role::fixed);
  const uint32_t box = m.box(Vec3(0.2, 0.2, 0.2));
  const int side = static_cast<int>(std::ceil(std::sqrt(options.bodies)));
  for (int i = 0; i < options.bodies; ++i) {
    m.body(box, rough, Vec3(0.2 * (i % side), 0.1, 0.2 * (i / side))).asleep = true;
  }
  m.body(box, smooth, Vec3(-1, 0.1, 0)).linear_velocity = Vec3(-1, 0, 0);
  return m;
}

void run(const Options& options, const std::string& name, SmallModel& m) {
  m.scene.simulator.engine = name == "bullet" ? EngineKind::bullet : EngineKind::exact;
  const auto simulator = make_simulator(m.scene, m.model);
  double cpu_s = 0, seconds = 0, busiest = 0, greatest = 0;
  StageTimes stages;
  FrameStatistics last;
  for (int frame = 1; frame <= options.frames; ++frame) {
    const auto start = Clock::now();
    const std::clock_t cpu_start = std::clock();
    last = simulator->step_frame();
    const double taken = std::chrono::duration<double>(Clock::now() - start).count();
    cpu_s += static_cast<double>(std::clock() - cpu_start) / CLOCKS_PER_SEC;
    seconds += taken;
    busiest = std::max(busiest, taken);
    stages += last.times;
    if (options.every > 0 && frame % options.every == 0) {
      greatest = std::max(
          greatest,
          inspect_pile(m.model, m.scene.gravity, simulator->states()).deepest_penetration_m);
    }
  }
  const PileQuality quality = inspect_pile(m.model, m.scene.gravity, simulator->states());
  greatest = std::max(greatest, quality.deepest_penetration_m);
  double height = 0, radius = 0;
  const BodyStates& states = simulator->states();
  Vec3 middle = Vec3::Zero();
  for (size_t i = 1; i < states.size(); ++i) middle += states.position[i];
  middle /= static_cast<double>(states.size() - 1);
  for (size_t i = 1; i < states.size(); ++i) {
    const Vec3 arm = states.position[i] - middle;
    height += states.position[i].y();
    radius += std::hypot(arm.x(), arm.z());
  }
  const auto count = static_cast<double>(states.size() - 1);
  std::printf(
      "%-7s %8.3f s, of all processors %.3f s (broad %.3f narrow %.3f solver %.3f other %.3f; "
      "busiest frame %.4f)\n"
      "        final overlap mean %.3f deepest %.2f mm, greatest of the run %.1f mm; own deepest "
      "%.2f mm\n"
      "        kinetic %.3g J, awake %u, height %.4f m, radius %.4f m, contacts %u\n",
      name.c_str(), seconds, cpu_s, stages.of(Stage::broad_phase), stages.of(Stage::narrow_phase),
      stages.of(Stage::solver), stages.of(Stage::integration) + stages.other_s(), busiest,
      1e3 * quality.mean_penetration_m, 1e3 * quality.deepest_penetration_m, 1e3 * greatest,
      1e3 * last.deepest_penetration_m, last.kinetic_energy_j, last.bodies_awake, height / count,
      radius / count, last.contacts);
  std::fflush(stdout);
}

int run_all(int argc, char** argv) {
  Options options;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const auto value = [&] { return i + 1 < argc ? std::string(argv[++i]) : std::string(); };
    if (word == "--hulls")
      options.bodies = std::stoi(value());
    else if (word == "--rabbits") {
      options.bodies = std::stoi(value());
      options.rabbits = true;
    } else if (word == "--balls") {
      options.bodies = std::stoi(value());
      options.balls = true;
    } else if (word == "--sleepers") {
      options.bodies = std::stoi(value());
      options.sleepers = true;
    } else if (word == "--step")
      options.step_hz = std::stoi(value());
    else if (word == "--frames")
      options.frames = std::stoi(value());
    else if (word == "--every")
      options.every = std::stoi(value());
    else if (word == "--threads")
      set_thread_count(std::stoi(value()));
    else if (word == "--mesh")
      options.mesh = value();
    else if (word == "exact" || word == "bullet")
      options.engines.push_back(word);
    else
      throw Error(ErrorKind::usage,
                  {.found = "'" + word + "'", .expected = "an option or an engine"});
  }
  if (options.engines.empty()) options.engines = {"exact", "bullet"};
  SmallModel m = options.sleepers ? sleepers(options) : pile(options);
  std::printf("%s\n%d %s, step 1/%d s, %d frames, %d threads\n", machine_info().cpu.c_str(),
              options.bodies,
              options.sleepers  ? "sleepers"
              : options.balls   ? "balls"
              : options.rabbits ? "rabbits"
                                : "hulls",
              options.step_hz, options.frames, thread_count());
  for (const std::string& engine : options.engines) run(options, engine, m);
  return 0;
}

}  // namespace
}  // namespace pilesim

int main(int argc, char** argv) {
  return pilesim::report_errors([&] { return pilesim::run_all(argc, argv); });
}
