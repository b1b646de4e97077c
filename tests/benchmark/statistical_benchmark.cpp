// The statistical mode beside the impulse mode: rabbits dropped in a cubic grid onto a plane, 420
// frames at 60 Hz with one step per frame.
//   statistical_benchmark BODIES SEEDS [IMPULSE_FRAMES [MESH]]
// Prints the time by stage, the cost of an awake body per step, and the resulting pile.
// IMPULSE_FRAMES > 0 also runs that many frames of the impulse mode (at 1/120 s, with the mesh's
// decomposition), with the first seed.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <vector>

#include "core/parallel_for.h"
#include "report/machine_info.h"
#include "report_errors.h"
#include "simulate/modes/make_simulator.h"
#include "simulate/simulator.h"
#include "support/measured_signature.h"

namespace pilesim {
namespace {

namespace fs = std::filesystem;
constexpr int kFrames = 420;
constexpr double kRestitution = 0.25, kFriction = 0.5;

Scene rabbits(int bodies, uint64_t seed, const fs::path& mesh, const fs::path& signature) {
  Scene scene;
  scene.name = "benchmark";
  scene.seed = seed;
  scene.step_s = 1.0 / 60;
  scene.simulator.mode = SimulatorMode::statistical;
  scene.simulator.solver_iterations = 8;
  scene.materials["rubber"] = {kRestitution, kFriction, 400};
  scene.shapes["ground"] = PlaneShape{};
  MeshShape rabbit{.file = mesh};
  rabbit.collision = CollisionKind::decomposition;
  rabbit.decomposition_max_pieces = 6;
  rabbit.hull_max_vertices = 24;
  rabbit.signature = signature;
  scene.shapes["rabbit"] = rabbit;
  scene.bodies.push_back(
      {.name = "ground", .shape = "ground", .material = "rubber", .role = Role::fixed});
  const int side = std::max(1, static_cast<int>(std::lround(std::cbrt(bodies))));
  Emitter emitter{.name = "rabbits", .shapes = {"rabbit"}, .material = "rubber"};
  emitter.source =
      GridSource{{0, 0.45 * side / 2 + 0.3, 0}, {side, side, side}, {0.36, 0.45, 0.36}};
  emitter.position_jitter_m = 0.03;
  emitter.angular_velocity_jitter = 2;
  scene.emitters.push_back(emitter);
  return scene;
}

void run_mode(const char* name, const Scene& scene, int frames) {
  const Model model = build_model(scene);
  const auto simulator = make_simulator(scene, model);
  StageTimes times;
  double awake_steps = 0, settled_s = 0;
  FrameStatistics statistics;
  for (int frame = 0; frame < frames; ++frame) {
    statistics = simulator->step_frame();
    times += statistics.times;
    awake_steps += static_cast<double>(statistics.bodies_awake) * statistics.steps;
    if (statistics.bodies_awake > 0) settled_s = (frame + 1) / scene.frame_rate;
  }
  double height = 0, highest = 0, radius = 0;
  const BodyStates& states = simulator->states();
  const auto count = static_cast<double>(states.size() - 1);
  for (size_t i = 1; i < states.size(); ++i) {
    height += states.position[i].y() / count;
    highest = std::max(highest, states.position[i].y());
    radius += std::hypot(states.position[i].x(), states.position[i].z()) / count;
  }
  std::printf("%-11s %.0f bodies, %d frames, seed %llu: %.2f s", name, count, frames,
              static_cast<unsigned long long>(scene.seed), times.total_s);
  std::printf("  broad %.2f narrow %.2f solver %.2f integration %.2f other %.2f",
              times.of(Stage::broad_phase), times.of(Stage::narrow_phase), times.of(Stage::solver),
              times.of(Stage::integration), times.other_s());
  std::printf("  %.0f ns a body awake and step\n", 1e9 * times.total_s / awake_steps);
  std::printf(
      "            height mean %.3f m, highest %.3f m, radius mean %.3f m; last awake at "
      "%.2f s, %u awake at the end\n",
      height, highest, radius, settled_s, statistics.bodies_awake);
  std::fflush(stdout);
}

void run(int argc, char** argv) {
  const int bodies = argc > 1 ? std::atoi(argv[1]) : 1000;
  const int seeds = argc > 2 ? std::atoi(argv[2]) : 1;
  const int impulse_frames = argc > 3 ? std::atoi(argv[3]) : 0;
  const fs::path mesh = fs::absolute(argc > 4 ? argv[4] : PILESIM_SOURCE_DIR "/assets/rabbit.obj");
  const MachineInfo machine = machine_info();
  std::printf("%s, %s, %d threads\n", machine.cpu.c_str(), machine.system.c_str(), thread_count());
  const fs::path signature =
      fs::temp_directory_path() / ("pilesim_benchmark." + std::to_string(bodies) + ".sig");
  SignatureOptions options{.mesh = mesh};
  options.material = {.restitution = kRestitution, .friction = kFriction};
  measure_signature(options, signature);
  for (int seed = 1; seed <= seeds; ++seed) {
    run_mode("statistical", rabbits(bodies, static_cast<uint64_t>(seed), mesh, signature), kFrames);
  }
  if (impulse_frames > 0) {
    Scene scene = rabbits(bodies, 1, mesh, signature);
    scene.simulator = {};
    scene.step_s = 1.0 / 120;
    run_mode("impulse", scene, impulse_frames);
  }
  fs::remove(signature);
}

}  // namespace
}  // namespace pilesim

int main(int argc, char** argv) {
  return pilesim::report_errors([&] { pilesim::run(argc, argv); });
}
