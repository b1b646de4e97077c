// Fits the cost model of the mixed mode (simulate/mixed/cost_model.h) and says how well it
// predicts:
//   budget_benchmark SCENE[+/POINTER=VALUE]...
// Steps each scene and takes the processor time of its frames beside the work that the simulator
// counts. On one thread: more would be awake while they wait for each other. Costs of at least zero
// are fitted to all frames by least squares of the error over the scene's mean, scenes counting
// alike. Prints them as they stand in mixed_constants.h, and for each scene the time of all frames
// as predicted by the costs that the program has, by those fitted here, and by those fitted to the
// other scenes alone, over the time measured; and of how many frames it is within 30 %.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/parallel_for.h"
#include "job/measured_signatures.h"
#include "report/machine_info.h"
#include "report_errors.h"
#include "scene/scene_loader.h"
#include "simulate/mixed/mixed_constants.h"
#include "simulate/modes/make_simulator.h"
#include "simulate/simulator.h"

namespace pilesim {
namespace {

constexpr size_t kKinds = 6;
using Costs = std::array<double, kKinds>;  // us
constexpr std::array<const char*, kKinds> kWork = {"spheres", "sphere_contacts", "blocks",
                                                   "pieces",  "solved",          "solved_pieces"};
constexpr std::array<const char*, kKinds> kNames = {
    "kSphereUs", "kSphereContactUs", "kBlockUs", "kPieceUs", "kSolvedUs", "kSolvedPieceUs"};
using namespace mixed_constants;
constexpr Costs kNow = {kSphereUs, kSphereContactUs, kBlockUs, kPieceUs, kSolvedUs, kSolvedPieceUs};
constexpr double kWithin = 0.3;

struct Frame {
  Costs work;
  double us;
};
struct Measured {
  std::string name;
  int steps_per_frame;
  std::vector<Frame> frames;
};

double cpu_us() {
  timespec now;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return 1e6 * static_cast<double>(now.tv_sec) + 1e-3 * static_cast<double>(now.tv_nsec);
}

double dot(const Costs& a, const Costs& b) {
  double sum = 0;
  for (size_t k = 0; k < kKinds; ++k) sum += a[k] * b[k];
  return sum;
}

Measured measure(const std::string& argument) {
  std::vector<std::string> overrides;
  std::string rest = argument;
  for (size_t at; (at = rest.rfind("+/")) != std::string::npos; rest.resize(at)) {
    overrides.insert(overrides.begin(), rest.substr(at + 1));
  }
  const Scene scene = load_scene(rest, overrides).scene;
  Model model = build_model(scene);
  measure_signatures(scene, model, ProgressMode::none);
  const std::unique_ptr<Simulator> simulator = make_simulator(scene, model);
  Measured measured{argument, scene.steps_per_frame(), {}};
  Costs before{};
  const auto frames = static_cast<size_t>(scene.duration_s * scene.frame_rate + 0.5);
  for (size_t i = 0; i < frames; ++i) {
    const double start_us = cpu_us();
    simulator->step_frame();
    Frame frame{{}, cpu_us() - start_us};
    const auto figures = nlohmann::json::parse(simulator->figures());
    for (size_t k = 0; k < kKinds; ++k) {
      const double all = figures["work"][kWork[k]];
      frame.work[k] = all - before[k];
      before[k] = all;
    }
    measured.frames.push_back(frame);
  }
  return measured;
}

double mean_us(const Measured& measured) {
  double sum = 0;
  for (const Frame& f : measured.frames) sum += f.us;
  return sum / static_cast<double>(measured.frames.size());
}

// Frames that take next to nothing tell nothing.
double scale_us(const Measured& measured, const Frame& frame) {
  return std::max(frame.us, 0.1 * mean_us(measured));
}

// Least squares, none below zero: coordinate after coordinate.
Costs fit(const std::vector<Measured>& scenes, size_t without) {
  std::array<Costs, kKinds> square{};
  Costs right{};
  for (size_t s = 0; s < scenes.size(); ++s) {
    if (s == without) continue;
    for (const Frame& frame : scenes[s].frames) {
      const double scale = mean_us(scenes[s]);
      const double weight = 1 / (scale * scale * static_cast<double>(scenes[s].frames.size()));
      for (size_t i = 0; i < kKinds; ++i) {
        right[i] += weight * frame.work[i] * frame.us;
        for (size_t j = 0; j < kKinds; ++j) square[i][j] += weight * frame.work[i] * frame.work[j];
      }
    }
  }
  Costs costs{};
  for (int round = 0; round < 100'000; ++round) {
    for (size_t i = 0; i < kKinds; ++i) {
      if (square[i][i] == 0) continue;
      const double others = dot(square[i], costs) - square[i][i] * costs[i];
      costs[i] = std::max(0.0, (right[i] - others) / square[i][i]);
    }
  }
  return costs;
}

struct Prediction {
  double all;     // predicted over measured
  double within;  // share of frames
};
Prediction predict(const Measured& scene, const Costs& costs) {
  double predicted = 0, measured = 0, within = 0;
  for (const Frame& frame : scene.frames) {
    const double us = dot(costs, frame.work);
    predicted += us;
    measured += frame.us;
    if (std::abs(us - frame.us) <= kWithin * scale_us(scene, frame)) ++within;
  }
  return {predicted / measured, within / static_cast<double>(scene.frames.size())};
}

void run(int argc, char** argv) {
  if (argc < 2) {
    throw Error(ErrorKind::usage, {.found = "budget_benchmark SCENE[+/POINTER=VALUE]..."});
  }
  set_thread_count(1);
  const MachineInfo machine = machine_info();
  std::printf("%s, %s, %d threads\n", machine.cpu.c_str(), machine.system.c_str(), thread_count());
  std::vector<Measured> scenes;
  for (int i = 1; i < argc; ++i) scenes.push_back(measure(argv[i]));
  const Costs all = fit(scenes, scenes.size());
  for (size_t k = 0; k < kKinds; ++k) {
    std::printf("  %-16s now %6.2f us, fitted %6.2f us\n", kNames[k], kNow[k], all[k]);
  }
  for (size_t s = 0; s < scenes.size(); ++s) {
    double ms = 0;
    for (const Frame& frame : scenes[s].frames) ms += 1e-3 * frame.us;
    Costs work{};
    for (const Frame& frame : scenes[s].frames) {
      for (size_t k = 0; k < kKinds; ++k) work[k] += frame.work[k];
    }
    std::printf("%s: %.2f ms a frame; in the mean", scenes[s].name.c_str(),
                ms / static_cast<double>(scenes[s].frames.size()));
    const double steps = static_cast<double>(scenes[s].frames.size()) * scenes[s].steps_per_frame;
    for (size_t k = 0; k < kKinds; ++k) std::printf(" %.0f %s", work[k] / steps, kWork[k]);
    std::printf("\n");
    const auto print = [&](const char* which, const Costs& costs) {
      const Prediction prediction = predict(scenes[s], costs);
      std::printf("  %-22s predicts %.2f of it; %3.0f %% of the frames within 30 %%\n", which,
                  prediction.all, 100 * prediction.within);
    };
    print("the model as it is", kNow);
    print("fitted to all", all);
    if (scenes.size() > 1) print("fitted to the others", fit(scenes, s));
  }
}

}  // namespace
}  // namespace pilesim

int main(int argc, char** argv) {
  return pilesim::report_errors([&] { pilesim::run(argc, argv); });
}
