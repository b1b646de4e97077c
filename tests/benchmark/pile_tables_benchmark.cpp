// Tables 5.1 and 5.2 of the dissertation, measured here, beside its own numbers:
//   pile_tables_benchmark times [FRAMES [CHARTS_DIRECTORY [PRESET,...]]]
//   pile_tables_benchmark tau [FRAMES]
//   pile_tables_benchmark errors [FRAMES [PRESET,...]]
// FRAMES is the largest number of frames per preset (0: all). `times` steps three simulations of a
// preset in turns, frame by frame: without sleep, with the engine's own sleep, and with piles;
// times are user CPU times of the process. `tau` repeats example 2 with other thresholds. `errors`,
// for presets with one pile, gives the part of the error that comes from different slopes. It
// compares with the simulation without sleep: piles of the requested angle, piles of the angle
// which that simulation takes by itself, and the same simulation under 9.8101 m/s^2, which makes no
// real error.
//
// Errors are those of section 5.3.2.4: m is the motion of a body's centre in a frame of the
// simulation without sleep, m' that with piles, and |m - m'| / |m| is averaged over bodies and
// frames. If |m| is below 0.01 D (D: the longest extent), the divisor is 0.01 D instead. The ratio
// of the sums of |m - m'| and |m| needs no such rule.
#include <array>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include <sys/resource.h>

#include "core/error.h"
#include "core/subprocess.h"
#include "job/measured_signatures.h"
#include "pile/repose/repose_director.h"
#include "report/machine_info.h"
#include "report_errors.h"
#include "scene/scene_loader.h"
#include "simulate/modes/make_simulator.h"

namespace pilesim {
namespace {

struct Published {
  const char* preset;
  double full_s, piles_s, error_percent;  // from Table 5.1; 0: not listed
};
constexpr Published kTable51[] = {
    {"drop_in_a_pile", 4125.4, 681.5, 5.8},
    {"varying_drops", 495.2, 231.9, 20.8},
    {"multiple_piles", 5571.2, 1488.2, 5.1},
    {"rabbit_matrix_20", 596.1, 502.3, 9.3},
    {"rabbit_matrix_35", 596.1, 359.4, 16.0},
    {"rabbit_matrix_45", 596.1, 333.4, 4.2},
    {"drop_in_a_line", 1461.6, 600.8, 9.6},
    {"rings_in_a_box", 4904.2, 2557.2, 9.9},
    {"multiple_sizes", 0, 0, 0},
    {"pile_hit", 0, 0, 0},
};
struct PublishedTau {
  double tau, speed_up;
};
constexpr PublishedTau kTable52[] = {{0.7, 1.2}, {0.6, 1.8}, {0.5, 2.1}, {0.4, 2.3}, {0.3, 2.5}};

double cpu_now_s() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_utime.tv_sec) +
         1e-6 * static_cast<double>(usage.ru_utime.tv_usec);
}

// One simulation of a preset, with its time.
struct Run {
  Scene scene;
  Model model;
  std::unique_ptr<ReposeDirector> director;
  std::unique_ptr<StepDirector> measuring;
  std::unique_ptr<Simulator> simulator;
  FrameStatistics last;
  double frame_s = 0, total_s = 0;
  std::vector<Vec3> before;

  void step_frame() {
    before = simulator->states().position;
    const double start_s = cpu_now_s();
    last = simulator->step_frame();
    frame_s = cpu_now_s() - start_s;
    total_s += frame_s;
  }
};

struct MeasureAtTheEnd final : StepDirector {
  MeasureAtTheEnd(ReposeDirector& piles, int64_t frames) : director(piles), left(frames) {}
  void direct(BodyControl& control) override { director.direct(control); }
  void end_frame(BodyControl& control) override {
    if (--left == 0) director.measure(control);
  }
  ReposeDirector& director;
  int64_t left;
};

int64_t frames_of(const Scene& scene, int64_t most) {
  const int64_t all = scene.frame_count() - 1;
  return most > 0 ? std::min(most, all) : all;
}

enum class Kind { full, sleeping, piles };

std::unique_ptr<Run> start(const std::string& preset, Kind kind, int64_t most_frames,
                           std::vector<std::string> overrides = {}) {
  overrides.push_back(std::string("/simulator/sleeping=") +
                      (kind == Kind::full ? "false" : "true"));
  auto run = std::make_unique<Run>();
  run->scene =
      load_scene(PILESIM_SOURCE_DIR "/presets/repose/" + preset + ".json", overrides).scene;
  run->model = build_model(run->scene);
  measure_signatures(run->scene, run->model, {});
  if (kind == Kind::piles) {
    run->director = std::make_unique<ReposeDirector>(run->scene, run->model);
    run->measuring =
        std::make_unique<MeasureAtTheEnd>(*run->director, frames_of(run->scene, most_frames));
    run->simulator = make_directed_simulator(run->scene, run->model, *run->measuring);
  } else {
    run->simulator = make_simulator(run->scene, run->model);
  }
  return run;
}

struct Errors {
  double relative = 0, bodies = 0;        // sum and number
  double difference_m = 0, motion_m = 0;  // sums
  double percent() const { return bodies > 0 ? 100 * relative / bodies : 0; }
  double percent_of_sums() const { return motion_m > 0 ? 100 * difference_m / motion_m : 0; }
  double absolute_m() const { return bodies > 0 ? difference_m / bodies : 0; }
  void add(const Errors& more) {
    relative += more.relative;
    bodies += more.bodies;
    difference_m += more.difference_m;
    motion_m += more.motion_m;
  }
};

Errors compare(const Run& full, const Run& piles, double least_m) {
  Errors errors;
  const BodyStates& a = full.simulator->states();
  const BodyStates& b = piles.simulator->states();
  for (uint32_t body = 0; body < full.model.bodies.size(); ++body) {
    if (full.model.bodies[body].role != Role::dynamic || (a.flags[body] & kPresent) == 0) continue;
    const Vec3 motion = a.position[body] - full.before[body];
    const double difference_m = (motion - (b.position[body] - piles.before[body])).norm();
    errors.relative += difference_m / std::max(motion.norm(), least_m);
    errors.difference_m += difference_m;
    errors.motion_m += motion.norm();
    ++errors.bodies;
  }
  return errors;
}

struct ChartRow {
  double full_s, sleeping_s, piles_s, percent, absolute_m;
};

// As in Figures 5.9 and 5.10: times of frames (means over a second) and errors.
void write_chart(const std::string& directory, const std::string& preset,
                 const std::vector<ChartRow>& rows, int smoothing) {
  const std::string name = directory + "/" + preset;
  std::ofstream csv(name + ".csv");
  csv << "frame,full_s,sleeping_s,piles_s,relative_error_percent,absolute_error_m\n";
  for (size_t i = 0; i < rows.size(); ++i) {
    const ChartRow& r = rows[i];
    csv << i + 1 << ',' << r.full_s << ',' << r.sleeping_s << ',' << r.piles_s << ',' << r.percent
        << ',' << r.absolute_m << '\n';
  }
  csv.close();
  if (!csv) {
    throw Error(ErrorKind::io, Problem{.file = name + ".csv", .found = "cannot be written"});
  }
  const std::string every = " every " + std::to_string(smoothing);
  run_program(
      {"gnuplot"}, "gnuplot-nox",
      "set terminal svg size 760,360 dynamic background '#ffffff'\nset output '" + name +
          ".svg'\nset datafile separator ','\nset key outside right top\n"
          "set xlabel 'frame'\nset ylabel 'CPU ms a frame'\nset y2label 'relative error, %'\n"
          "set ytics nomirror\nset y2tics\nset yrange [0:*]\nset y2range [0:*]\nplot '" +
          name + ".csv'" + every + " using 1:(1e3*$2) with lines lc rgb '#444444' title 'full'" +
          ", ''" + every + " using 1:(1e3*$3) with lines lc rgb '#4c78a8' title 'sleeping'" +
          ", ''" + every + " using 1:(1e3*$4) with lines lc rgb '#e45756' title 'piles'" + ", ''" +
          every + " using 1:5 axes x1y2 with lines lc rgb '#aaaaaa' title 'error'\n");
}

std::string percent_text(double percent) {
  char text[24];
  std::snprintf(text, sizeof text, percent > 0 ? "%.1f" : "-", percent);
  return text;
}

void print_times(const Published& published, int64_t frames, const Run& full, const Run& sleeping,
                 const Run& piles, const Errors& errors) {
  double worst_deg = 0, asked_deg = 0, got_deg = 0;
  for (const PileState& pile : piles.director->piles()) {
    if (pile.slope.azimuths == 0) continue;
    const double miss_deg = std::abs(degrees(pile.slope.angle - pile.settings.angle));
    if (asked_deg > 0 && miss_deg <= worst_deg) continue;
    worst_deg = miss_deg;
    asked_deg = degrees(pile.settings.angle);
    got_deg = degrees(pile.slope.angle);
  }
  const PlausibilityCounts& counts = piles.director->plausibility();
  const double theirs = published.piles_s > 0 ? published.full_s / published.piles_s : 0;
  std::printf(
      "%-17s %6lld %8.1f %8.1f %8.1f %7.1fx %6.1fx %6sx | %8.1f %8.1f %8.3g %6s | %3.0f %5.1f | "
      "%5u %3u %3u\n",
      published.preset, static_cast<long long>(frames), full.total_s, sleeping.total_s,
      piles.total_s, full.total_s / piles.total_s, sleeping.total_s / piles.total_s,
      percent_text(theirs).c_str(), errors.percent(), errors.percent_of_sums(),
      1e3 * errors.absolute_m(), percent_text(published.error_percent).c_str(), asked_deg, got_deg,
      piles.last.bodies_awake, counts.hanging, counts.inside);
  std::fflush(stdout);
}

void measure_times(const Published& published, int64_t most_frames, const std::string& charts) {
  const auto full = start(published.preset, Kind::full, most_frames);
  const auto sleeping = start(published.preset, Kind::sleeping, most_frames);
  const auto piles = start(published.preset, Kind::piles, most_frames);
  const double least_m = 0.01 * PileBodies(full->model).longest_m;
  const int64_t frames = frames_of(full->scene, most_frames);
  Errors all;
  std::vector<ChartRow> rows;
  for (int64_t frame = 0; frame < frames; ++frame) {
    for (Run* run : {full.get(), sleeping.get(), piles.get()}) run->step_frame();
    const Errors errors = compare(*full, *piles, least_m);
    all.add(errors);
    rows.push_back(
        {full->frame_s, sleeping->frame_s, piles->frame_s, errors.percent(), errors.absolute_m()});
  }
  print_times(published, frames, *full, *sleeping, *piles, all);
  if (!charts.empty()) write_chart(charts, published.preset, rows, 4);
}

bool is_listed(const std::string& name, const std::string& list) {
  return list.empty() || ("," + list + ",").find("," + name + ",") != std::string::npos;
}

void run_times(int64_t frames, const std::string& charts, const std::string& presets) {
  std::printf("%-17s %6s %8s %8s %8s %8s %7s %7s | %8s %8s %8s %6s | %3s %5s | %5s %3s %3s\n", "",
              "frames", "full s", "sleep s", "piles s", "full/p", "slp/p", "(5.1)", "error %",
              "sums %", "mm", "(5.1)", "ask", "got", "awake", "air", "in");
  for (const Published& published : kTable51) {
    if (is_listed(published.preset, presets)) measure_times(published, frames, charts);
  }
}

void run_tau(int64_t most_frames) {
  const auto full = start("varying_drops", Kind::full, most_frames);
  const int64_t frames = frames_of(full->scene, most_frames);
  for (int64_t frame = 0; frame < frames; ++frame) full->step_frame();
  std::printf("varying_drops, %lld frames, without sleeping %.1f s\n",
              static_cast<long long>(frames), full->total_s);
  std::printf("%5s %8s %8s %8s %6s %6s\n", "tau", "s", "speed-up", "(5.2)", "got", "awake");
  for (const PublishedTau& published : kTable52) {
    const auto run = start("varying_drops", Kind::piles, most_frames,
                           {"/piles/0/tau=" + std::to_string(published.tau)});
    for (int64_t frame = 0; frame < frames; ++frame) run->step_frame();
    std::printf("%5.1f %8.1f %7.1fx %7.1fx %6.1f %6u\n", published.tau, run->total_s,
                full->total_s / run->total_s, published.speed_up,
                degrees(run->director->piles()[0].slope.angle), run->last.bodies_awake);
    std::fflush(stdout);
  }
}

// Angle of the pile that a simulation without piles makes at the place of the first pile.
double natural_angle_deg(const Run& full) {
  const Pile& pile = full.scene.piles.at(0);
  const PileBodies bodies(full.model);
  const BodyStates& states = full.simulator->states();
  GroundPoint sum = GroundPoint::Zero();
  for (const uint32_t body : bodies.dynamic) {
    sum += GroundPoint(states.position[body].x(), states.position[body].z());
  }
  const PileShape shape(pile, sum / static_cast<double>(bodies.dynamic.size()));
  const double cell_m = 0.35 * bodies.size_m;
  const GroundPoint around = GroundPoint::Constant(25 * bodies.size_m);
  HeightField field({shape.middle() - around, shape.middle() + around}, cell_m, pile.base_m);
  for (const uint32_t body : bodies.dynamic) {
    field.add(columns_of(bodies.shape_of(full.model, body).surface,
                         {states.position[body], states.orientation[body]}, cell_m));
  }
  const auto inside = [&](const GroundPoint& point) { return shape.inside_walls(point); };
  return degrees(fit_slope(slope_angles(shape, field, inside)).angle);
}

Errors error_of(const std::string& preset, int64_t most_frames, Kind kind,
                const std::vector<std::string>& overrides) {
  const auto full = start(preset, Kind::full, most_frames);
  const auto other = start(preset, kind, most_frames, overrides);
  const double least_m = 0.01 * PileBodies(full->model).longest_m;
  const int64_t frames = frames_of(full->scene, most_frames);
  Errors all;
  for (int64_t frame = 0; frame < frames; ++frame) {
    full->step_frame();
    other->step_frame();
    all.add(compare(*full, *other, least_m));
  }
  return all;
}

void run_errors(int64_t most_frames, const std::string& presets) {
  std::printf("%-17s %-28s %8s %8s %8s\n", "", "", "error %", "sums %", "mm");
  for (const Published& published : kTable51) {
    if (!is_listed(published.preset, presets)) continue;
    const auto print = [&](const std::string& what, const Errors& errors) {
      std::printf("%-17s %-28s %8.1f %8.1f %8.3g\n", published.preset, what.c_str(),
                  errors.percent(), errors.percent_of_sums(), 1e3 * errors.absolute_m());
      std::fflush(stdout);
    };
    const auto full = start(published.preset, Kind::full, most_frames);
    if (full->scene.piles.size() != 1) continue;
    const int64_t frames = frames_of(full->scene, most_frames);
    for (int64_t frame = 0; frame < frames; ++frame) full->step_frame();
    const double natural_deg = natural_angle_deg(*full);
    print("angle asked", error_of(published.preset, most_frames, Kind::piles, {}));
    print("natural angle, " + std::to_string(natural_deg).substr(0, 4),
          error_of(published.preset, most_frames, Kind::piles,
                   {"/piles/0/angle_deg=" + std::to_string(natural_deg)}));
    print("full again, gravity +0.001 %",
          error_of(published.preset, most_frames, Kind::full, {"/gravity=[0,-9.8101,0]"}));
  }
}

void run(const std::vector<std::string>& arguments) {
  const auto argument = [&](size_t i) { return i < arguments.size() ? arguments[i] : ""; };
  const int64_t frames = std::atoll(argument(1).c_str());
  const MachineInfo machine = machine_info();
  std::printf("%s, %s\n", machine.cpu.c_str(), machine.system.c_str());
  if (argument(0) == "times") {
    run_times(frames, argument(2), argument(3));
  } else if (argument(0) == "tau") {
    run_tau(frames);
  } else if (argument(0) == "errors") {
    run_errors(frames, argument(2));
  } else {
    throw Error(ErrorKind::usage,
                Problem{.found = "'" + argument(0) + "'", .expected = "times, tau or errors"});
  }
}

}  // namespace
}  // namespace pilesim

int main(int argc, char** argv) {
  return pilesim::report_errors([&] { pilesim::run({argv + 1, argv + argc}); });
}
