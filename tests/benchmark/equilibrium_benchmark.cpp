// Time of the equilibrium analysis, and the share of its verdicts that are proved in long double:
//   equilibrium_benchmark [INSTANCES [BODIES]]
// Uses random instances, most of them degenerate, then the bodies of a pile of boxes, sticks and
// cylinders at every 20th step while it collapses and settles.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <vector>

#include "core/error.h"
#include "pile/guide/equilibrium.h"
#include "pile/guide/support_graph.h"
#include "report/machine_info.h"
#include "report_errors.h"
#include "simulate/body_control.h"
#include "simulate/modes/make_simulator.h"
#include "support/equilibrium_instances.h"
#include "support/pile_equilibrium.h"
#include "support/small_model.h"

namespace pilesim {
namespace {

constexpr double kTolerance = 1e-3;
constexpr double kBand = 1e-6;  // around the tolerance, where either verdict is right

// CPU time, independent of other programs.
double now_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
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

// Gathers and analyses as a guide's control does, with the clock running, then checks.
class Harvest final : public StepDirector {
 public:
  explicit Harvest(const Model& model) : model_(model), graph_(model) {}

  void direct(BodyControl& control) override {
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

// A brick wall as a whole.
void run_wall(int width, int height) {
  std::vector<PileBody> bodies = {{Vec3::Zero(), 1, 0}};
  std::vector<PileContact> contacts;
  const auto touch = [&](uint32_t upper, uint32_t lower, double from, double to, double y) {
    for (const double x : {from, to}) {
      for (const double z : {-0.25, 0.25}) {
        contacts.push_back({upper, lower, Vec3(x, y, z), Vec3::UnitY(), 0.6});
      }
    }
  };
  for (int row = 0; row < height; ++row) {
    for (int i = 0; i < width; ++i) {
      const double x = i + 0.5 * (row % 2), y = 0.5 * row;
      bodies.push_back({Vec3(x, y + 0.25, 0), 0.6, 1});
      const auto brick = static_cast<uint32_t>(bodies.size() - 1);
      const int left = row % 2 != 0 ? i : i - 1;
      const auto below = [&](int j) { return static_cast<uint32_t>(1 + (row - 1) * width + j); };
      if (row == 0) {
        touch(brick, 0, x - 0.5, x + 0.5, y);
        continue;
      }
      if (left >= 0) touch(brick, below(left), x - 0.5, x, y);
      if (left + 1 < width) touch(brick, below(left + 1), x, x + 0.5, y);
    }
  }
  const double start = now_s();
  const PileVerdict verdict = analyse_pile(bodies, contacts, Vec3::UnitY());
  std::printf("wall %d x %d: %s, %zu contacts, %d sweeps, %.3f s\n", width, height,
              verdict.kind == PileVerdict::Kind::stable ? "stable" : "not proved stable",
              contacts.size(), verdict.sweeps, now_s() - start);
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
  run_wall(50, 20);
  run_wall(25, 40);
}

}  // namespace
}  // namespace pilesim

int main(int argc, char** argv) {
  return pilesim::report_errors([&] { pilesim::run(argc, argv); });
}
