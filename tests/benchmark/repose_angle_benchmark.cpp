// Requested and resulting angles of repose of bodies poured onto one spot
// (presets/repose/pour.json):
//   repose_angle_benchmark [BODIES [SEEDS [SHAPE,... [ANGLE,... [MODE]]]]]
// With MODE, impulse or mixed, bodies have their own materials; in the mixed mode all are spheres.
// Prints one line per run, then the mean over the seeds with the standard deviation of a run.
// Angles are measured at the end, as by `pilesim direct-pile` (docs/direct_pile.md). Times are user
// CPU times of the whole run.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include <sys/resource.h>

#include "core/error.h"
#include "job/measured_signatures.h"
#include "pile/repose/repose_director.h"
#include "report_errors.h"
#include "scene/scene_loader.h"
#include "simulate/modes/make_simulator.h"

namespace pilesim {
namespace {

const std::string kPour = PILESIM_SOURCE_DIR "/presets/repose/pour.json";

struct Run {
  double angle_deg = 0, spread_deg = 0;
  uint32_t awake = 0;
  PlausibilityCounts counts;
  double cpu_s = 0;
};

double cpu_now_s() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_utime.tv_sec) +
         1e-6 * static_cast<double>(usage.ru_utime.tv_usec);
}

class MeasuredAtTheEnd final : public StepDirector {
 public:
  MeasuredAtTheEnd(const Scene& scene, const Model& model)
      : director(scene, model), frames_(scene.frame_count()) {}
  void direct(BodyControl& control) override { director.direct(control); }
  void end_frame(BodyControl& control) override {
    if (++frame_ + 1 == frames_) director.measure(control);
  }
  ReposeDirector director;

 private:
  int64_t frames_, frame_ = 0;
};

void use_material(const std::string& shape, std::vector<std::string>& overrides) {
  struct Known {
    double restitution, friction;
  };
  static const std::map<std::string, Known> materials = {{"box", {0.2, 0.5}},
                                                         {"l_shape", {0.25, 0.45}},
                                                         {"rabbit", {0.25, 0.5}},
                                                         {"ring", {0.3, 0.3}}};
  const Known& material = materials.at(shape);
  overrides.push_back("/materials/plastic/restitution=" + std::to_string(material.restitution));
  overrides.push_back("/materials/plastic/friction=" + std::to_string(material.friction));
  overrides.push_back(
      "/shapes/box=" +
      std::string(R"({"type":"mesh","file":"../../assets/box.obj","collision":"hull"})"));
}

Run pour(const std::string& shape, double angle_deg, int bodies, int seed,
         const std::string& mode) {
  // More bodies fall faster, over a wider area, from higher up.
  const bool many = bodies > 500;
  const double rate_hz = many ? 60 : 30;
  std::vector<std::string> overrides = {
      "/seed=" + std::to_string(seed),
      "/piles/0/angle_deg=" + std::to_string(angle_deg),
      "/emitters/0/shape=" + shape,
      "/emitters/0/count=" + std::to_string(bodies),
      "/emitters/0/rate_hz=" + std::to_string(rate_hz),
      "/emitters/0/radius=" + std::string(many ? "0.3" : "0.2"),
      "/emitters/0/centre=[0," + std::string(many ? "3.8" : "3.2") + ",0]",
      "/emitters/0/linear_velocity=[0," + std::string(many ? "-8" : "-6") + ",0]",
      "/duration_s=" + std::to_string(bodies / rate_hz + 2.5)};
  if (!mode.empty()) {
    use_material(shape, overrides);
    overrides.push_back("/simulator/mode=" + mode);
  }
  const Scene scene = load_scene(kPour, overrides).scene;
  Model model = build_model(scene);
  measure_signatures(scene, model, {});
  MeasuredAtTheEnd measured(scene, model);
  const auto simulator = make_directed_simulator(scene, model, measured);
  const double start_s = cpu_now_s();
  FrameStatistics last;
  for (int64_t frame = 1; frame < scene.frame_count(); ++frame) last = simulator->step_frame();
  const SlopeFit& slope = measured.director.piles()[0].slope;
  return {.angle_deg = degrees(slope.angle),
          .spread_deg = degrees(slope.spread),
          .awake = static_cast<uint32_t>(last.bodies_awake),
          .counts = measured.director.plausibility(),
          .cpu_s = cpu_now_s() - start_s};
}

std::vector<std::string> list_of(const std::string& text) {
  std::vector<std::string> items;
  std::istringstream stream(text);
  for (std::string item; std::getline(stream, item, ',');) items.push_back(item);
  return items;
}

void run(int argc, char** argv) {
  const int bodies = argc > 1 ? std::atoi(argv[1]) : 300;
  const int seeds = argc > 2 ? std::atoi(argv[2]) : 3;
  const auto shapes = list_of(argc > 3 ? argv[3] : "box,l_shape,rabbit,ring");
  const auto angles = list_of(argc > 4 ? argv[4] : "15,30,50");
  const std::string mode = argc > 5 ? argv[5] : "";
  if (bodies < 1 || seeds < 1) {
    throw Error(
        ErrorKind::usage,
        Problem{
            .found = "an argument out of range",
            .remedy = "repose_angle_benchmark [BODIES [SEEDS [SHAPE,... [ANGLE,... [MODE]]]]]"});
  }
  std::printf("%-8s %5s %5s %6s %6s %6s %5s %4s %6s %6s\n", "shape", "asked", "seed", "got",
              "spread", "asleep", "awake", "air", "inside", "cpu s");
  for (const std::string& shape : shapes) {
    for (const std::string& angle : angles) {
      double sum = 0, squares = 0;
      for (int seed = 1; seed <= seeds; ++seed) {
        const Run got = pour(shape, std::atof(angle.c_str()), bodies, seed, mode);
        sum += got.angle_deg;
        squares += got.angle_deg * got.angle_deg;
        std::printf("%-8s %5s %5d %6.1f %6.1f %6u %5u %4u %6u %6.1f\n", shape.c_str(),
                    angle.c_str(), seed, got.angle_deg, got.spread_deg, got.counts.asleep,
                    got.awake, got.counts.hanging, got.counts.inside, got.cpu_s);
        std::fflush(stdout);
      }
      const double mean = sum / seeds;
      const double deviation =
          seeds > 1 ? std::sqrt(std::max(0.0, squares - seeds * mean * mean) / (seeds - 1)) : 0;
      std::printf("%-8s %5s  mean %6.2f +- %.2f\n", shape.c_str(), angle.c_str(), mean, deviation);
    }
  }
}

}  // namespace
}  // namespace pilesim

int main(int argc, char** argv) {
  return pilesim::report_errors([&] { pilesim::run(argc, argv); });
}
