// Time of the equilibrium analysis and the share of its verdicts that are proved in long double:
//   equilibrium_benchmark [INSTANCES [BODIES]]
// Random instances, most of them degenerate, then the bodies of a pile of boxes, sticks and
// cylinders at every 20th step while it falls together and settles.
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "core/error.h"
#include "pile/candidates.h"
#include "pile/support_graph.h"
#include "report/machine_info.h"
#include "simulate/impulse_control.h"
#include "support/equilibrium_instances.h"
#include "support/small_model.h"

namespace pilesim {
namespace {

constexpr double kTolerance = 1e-3;
constexpr double kBand = 1e-6;  // about the tolerance, where either verdict is right

double now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

struct Tally {
  uint64_t bodies = 0, stable = 0, unproved = 0, sweeps = 0, contacts = 0;
  int most_sweeps = 0;

  void add(const test::EquilibriumInstance& instance, const EquilibriumVerdict& verdict,
           std::span<const ContactForce> forces) {
    ++bodies;
    stable += verdict.stable;
    sweeps += static_cast<uint64_t>(verdict.sweeps);
    contacts += instance.contacts.size();
    most_sweeps = std::max(most_sweeps, verdict.sweeps);
    const bool in_band = std::abs(verdict.unbalanced - kTolerance) < kBand;
    if (!in_band && !test::find_fault(instance, verdict, forces, kTolerance).empty()) ++unproved;
  }
  void print(const char* what) const {
    const auto n = static_cast<double>(std::max<uint64_t>(1, bodies));
    std::printf(
        "%-10s %8llu bodies, %.1f contacts, %.1f %% stable; %.1f sweeps (most %d); "
        "%llu not proved\n",
        what, static_cast<unsigned long long>(bodies), static_cast<double>(contacts) / n,
        100 * static_cast<double>(stable) / n, static_cast<double>(sweeps) / n, most_sweeps,
        static_cast<unsigned long long>(unproved));
  }
};

void run_random(uint64_t count) {
  Tally tally;
  EquilibriumSolver solver;
  for (uint64_t i = 0; i < count; ++i) {
    const test::EquilibriumInstance instance = test::random_instance(i);
    solver.set_body(instance.centre, instance.radius_m, instance.contacts);
    const EquilibriumVerdict verdict = solver.solve();
    tally.add(instance, verdict, solver.forces());
  }
  tally.print("random");
}

// Gathers and analyses as the control of a guide does, with the clock running, then checks.
class Harvest final : public StepDirector {
 public:
  explicit Harvest(const Model& model) : model_(model), graph_(model) {}

  void direct(ImpulseControl& control) override {
    if (step_++ % 20 != 1) return;
    double start = now_s();
    control.read_contacts(contacts_);
    graph_.build(contacts_);
    gather_s += now_s() - start;
    start = now_s();
    for (uint32_t body = 1; body < model_.bodies.size(); ++body) {
      solver_.set_body(control.motion(body).position, radius(body), graph_.supports(body));
      solver_.solve();
    }
    solve_s += now_s() - start;
    for (uint32_t body = 1; body < model_.bodies.size(); ++body) {
      const std::span<const SupportPoint> supports = graph_.supports(body);
      const test::EquilibriumInstance instance{
          control.motion(body).position, radius(body), {supports.begin(), supports.end()}};
      solver_.set_body(instance.centre, instance.radius_m, instance.contacts);
      const EquilibriumVerdict verdict = solver_.solve();
      tally.add(instance, verdict, solver_.forces());
    }
  }

  double gather_s = 0, solve_s = 0;
  Tally tally;

 private:
  double radius(uint32_t body) const {
    return model_.shapes[model_.bodies[body].shape].bounding_radius;
  }

  const Model& model_;
  SupportGraph graph_;
  EquilibriumSolver solver_;
  std::vector<BodyContact> contacts_;
  uint64_t step_ = 0;
};

void run_pile(int bodies) {
  SmallModel small;
  const uint32_t wood = small.material(0.1, 0.7);
  small.body(small.plane(), wood, Vec3::Zero(), Role::fixed);
  const uint32_t shapes[] = {small.box(Vec3(0.2, 0.2, 0.2)), small.box(Vec3(0.6, 0.05, 0.05)),
                             small.cylinder(0.1, 0.15), small.box(Vec3(0.3, 0.05, 0.2))};
  const int side = static_cast<int>(std::ceil(std::cbrt(bodies / 2.0)));
  for (int i = 0; i < bodies; ++i) {
    const Vec3 cell(i % side, i / (side * side) + 1, i / side % side);
    small.body(shapes[i % 4], wood, 0.35 * cell).pose.orientation =
        Philox(5, Stream::test, static_cast<uint64_t>(i)).rotation();
  }
  Harvest harvest(small.model);
  const auto simulator = make_directed_simulator(small.scene, small.model, harvest);
  for (int frame = 0; frame < 240; ++frame) simulator->step_frame();
  harvest.tally.print("harvested");
  const auto count = static_cast<double>(harvest.tally.bodies);
  std::printf("time a body: gathering %.2f us, analysis %.2f us, together %.2f us\n",
              1e6 * harvest.gather_s / count, 1e6 * harvest.solve_s / count,
              1e6 * (harvest.gather_s + harvest.solve_s) / count);
}

void run(int argc, char** argv) {
  const int instances = argc > 1 ? std::atoi(argv[1]) : 1'000'000;
  const int bodies = argc > 2 ? std::atoi(argv[2]) : 500;
  if (instances < 1 || bodies < 1) {
    throw Error(ErrorKind::usage, Problem{.found = "an argument out of range",
                                          .remedy = "equilibrium_benchmark [INSTANCES [BODIES]]"});
  }
  const MachineInfo machine = machine_info();
  std::printf("%s, %s\n", machine.cpu.c_str(), machine.system.c_str());
  run_random(static_cast<uint64_t>(instances));
  run_pile(bodies);
}

}  // namespace
}  // namespace pilesim

int main(int argc, char** argv) {
  try {
    pilesim::run(argc, argv);
  } catch (const pilesim::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
