// Modes of one scene side by side, in turns frame by frame, so that other load on the machine
// affects all of them alike:
//   mixed_benchmark SCENE OUT MODE... [--set /POINTER=VALUE]...
// Modes are named as in `pilesim compare`. Writes OUT/frames.csv, with wall and processor time of
// each frame in each mode, and OUT/frames.svg, a chart of the wall times as in Figures 4.2 to 4.5
// of the dissertation. Prints for each mode the sums, medians and 95th percentiles, and the
// speed-up over the first mode. It also prints the cost of an awake body per step: for a sphere,
// and for a convex piece of a body near must-impulse ones (least squares over the frames).
#include <algorithm>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/atomic_file.h"
#include "core/output_directory.h"
#include "core/parallel_for.h"
#include "job/measured_signatures.h"
#include "job/mode_spec.h"
#include "report/charts.h"
#include "report/machine_info.h"
#include "report_errors.h"
#include "scene/scene_loader.h"
#include "simulate/modes/make_simulator.h"
#include "simulate/simulator.h"

namespace pilesim {
namespace {

double cpu_s() {
  timespec now;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

class Run {
 public:
  Run(std::string name, const std::string& file, std::vector<std::string> overrides,
      const ModeSpec& mode)
      : name_(std::move(name)) {
    overrides.insert(overrides.end(), mode.overrides.begin(), mode.overrides.end());
    scene_ = load_scene(file, overrides).scene;
    model_ = build_model(scene_);
    measure_signatures(scene_, model_, {});
    simulator_ = make_simulator(scene_, model_);
  }

  const std::string& name() const { return name_; }
  const Scene& scene() const { return scene_; }
  const std::vector<double>& wall_ms() const { return wall_ms_; }
  const std::vector<double>& cpu_ms() const { return cpu_ms_; }

  void step_frame() {
    const double before = cpu_s();
    const FrameStatistics statistics = simulator_->step_frame();
    cpu_ms_.push_back(1e3 * (cpu_s() - before));
    wall_ms_.push_back(1e3 * statistics.times.total_s);
    double far = 0, pieces = 0;
    const BodyStates& states = simulator_->states();
    for (size_t i = 0; i < states.size(); ++i) {
      const ModelBody& body = model_.bodies[i];
      const uint8_t flags = states.flags[i];
      if (body.role != Role::dynamic || (flags & kPresent) == 0 || (flags & kAsleep) != 0) continue;
      const auto count = static_cast<double>(model_.shapes[body.shape].pieces.size());
      ((flags & kImpulse) != 0 ? pieces : far) += (flags & kImpulse) != 0 ? count : 1;
    }
    far_.push_back(far * statistics.steps);
    pieces_.push_back(pieces * statistics.steps);
  }

  void print(const Run& first) const {
    const auto [wall, wall_high] = percentiles(wall_ms_);
    const auto [cpu, cpu_high] = percentiles(cpu_ms_);
    std::printf("%-48s wall %7.2f ms a frame (95 %%: %7.2f), %8.2f s; CPU %7.2f (%7.2f), %8.2f s",
                name_.c_str(), wall, wall_high, 1e-3 * sum(wall_ms_), cpu, cpu_high,
                1e-3 * sum(cpu_ms_));
    std::printf("; times faster %.1f\n", sum(first.cpu_ms_) / sum(cpu_ms_));
    print_costs();
  }

 private:
  static double sum(const std::vector<double>& values) {
    double sum = 0;
    for (const double value : values) sum += value;
    return sum;
  }
  static std::pair<double, double> percentiles(std::vector<double> values) {
    std::ranges::sort(values);
    return {values[values.size() / 2], values[values.size() * 95 / 100]};
  }

  void print_costs() const {
    double ff = 0, fp = 0, pp = 0, ft = 0, pt = 0;
    for (size_t i = 0; i < cpu_ms_.size(); ++i) {
      ff += far_[i] * far_[i];
      fp += far_[i] * pieces_[i];
      pp += pieces_[i] * pieces_[i];
      ft += far_[i] * cpu_ms_[i];
      pt += pieces_[i] * cpu_ms_[i];
    }
    const double determinant = ff * pp - fp * fp;
    double far_ms = ff > 0 ? ft / ff : 0, piece_ms = pp > 0 ? pt / pp : 0;
    if (determinant > 1e-6 * ff * pp) {
      far_ms = (ft * pp - pt * fp) / determinant;
      piece_ms = (pt * ff - ft * fp) / determinant;
    }
    std::printf("    a sphere %.2f us a step, a solved body %.2f us a piece and step\n",
                1e3 * far_ms, 1e3 * piece_ms);
  }

  std::string name_;
  Scene scene_;
  Model model_;
  std::unique_ptr<Simulator> simulator_;
  std::vector<double> wall_ms_, cpu_ms_;  // by frame
  std::vector<double> far_, pieces_;      // by frame, times steps: awake
};

void write(const std::filesystem::path& directory, const std::vector<double>& time_s,
           const std::vector<std::unique_ptr<Run>>& runs) {
  std::string csv = "time_s";
  std::vector<ChartLine> lines;
  for (const auto& run : runs) {
    csv += "," + run->name() + " wall_ms," + run->name() + " cpu_ms";
    lines.push_back({run->name(), run->wall_ms()});
  }
  for (size_t i = 0; i < time_s.size(); ++i) {
    csv += "\n" + std::to_string(time_s[i]);
    for (const auto& run : runs) {
      csv += "," + std::to_string(run->wall_ms()[i]) + "," + std::to_string(run->cpu_ms()[i]);
    }
  }
  write_file_atomically(directory / "frames.csv", csv + "\n");
  write_file_atomically(directory / "frames.svg",
                        line_chart("Time per frame", "ms a frame", time_s, lines).svg);
}

void run(int argc, char** argv) {
  std::vector<std::string> names, overrides;
  for (int i = 3; i < argc; ++i) {
    if (std::string(argv[i]) == "--set" && i + 1 < argc) {
      overrides.emplace_back(argv[++i]);
    } else {
      names.emplace_back(argv[i]);
    }
  }
  if (names.empty()) {
    throw Error(ErrorKind::usage,
                {.found = "mixed_benchmark SCENE OUT MODE... [--set /POINTER=VALUE]..."});
  }
  const std::string file = argv[1];
  const Scene scene = load_scene(file, overrides).scene;
  make_output_directory(argv[2]);
  std::vector<std::unique_ptr<Run>> runs;
  for (const std::string& name : names) {
    runs.push_back(std::make_unique<Run>(name, file, overrides, resolve_mode(name, scene)));
  }
  const MachineInfo machine = machine_info();
  std::printf("%s, %s, %d threads\n", machine.cpu.c_str(), machine.system.c_str(), thread_count());
  std::vector<double> time_s;
  const auto frames = static_cast<size_t>(std::lround(scene.duration_s * scene.frame_rate));
  while (time_s.size() < frames) {
    time_s.push_back(static_cast<double>(time_s.size() + 1) / scene.frame_rate);
    for (const auto& run : runs) run->step_frame();
  }
  for (const auto& run : runs) run->print(*runs[0]);
  write(argv[2], time_s, runs);
}

}  // namespace
}  // namespace pilesim

int main(int argc, char** argv) {
  return pilesim::report_errors([&] { pilesim::run(argc, argv); });
}
