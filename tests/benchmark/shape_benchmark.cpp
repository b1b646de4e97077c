// The statistical mode beside the impulse mode on shapes that were not used for tuning: 24
// generated solids (support/solid_families.h) and eleven assets, in four scenes, with several
// seeds.
//   shape_benchmark [-o DIRECTORY] [--seeds N] [--scene NAME]... [SHAPE...]
// Scenes: plane125 and plane512, bodies that fall onto a plane; crate200; and funnel125, through a
// funnel onto a plane. A shape's signature is measured first, including its packing. Prints the
// differences of mean height, mean radius, pile angle and packing from the reference (in brackets:
// deviations of single runs of the reference and of the statistical mode). Also prints how many are
// within the goals of each scene, how many would be by chance alone, and how many are within a few
// of the reference's own deviations. Meshes, signatures and the reference's runs (reference.csv)
// stay in the directory: remove it after a change of the exact engine.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "core/error.h"
#include "geometry/mesh_import.h"
#include "geometry/obj_writer.h"
#include "report_errors.h"
#include "signature/signature_file.h"
#include "simulate/modes/make_simulator.h"
#include "simulate/simulator.h"
#include "support/measured_signature.h"
#include "support/solid_families.h"

namespace pilesim {
namespace {

namespace fs = std::filesystem;
constexpr double kRadius = 0.2;  // bounding radius of a body, m
constexpr double kRestitution = 0.25, kFriction = 0.5;
constexpr double kSpacing = 0.42, kJitter = 0.01;  // m
constexpr double kFloor = 0.1;                     // size of a crate, and thickness of its walls, m
// For presets/hard/funnel.obj: its outlet is 7 radii wide, at this height, m.
constexpr double kFunnelScale = 2, kOutlet = 1.2, kFunnelHeight = 1.4 * kFunnelScale;

struct Options {
  fs::path output = "out/shapes";
  int seeds = 3;
  std::vector<std::string> scenes, names;
};

// Figures of a pile at rest.
struct Figures {
  double height = 0;  // m, mean of the centres above the ground
  double radius = 0;  // m, mean distance of the centres from the axis
  double angle = 0;   // degrees, of the cone with the same means
  double packing =
      0;  // bodies' volume over that of columns 2 R wide, up to the highest body in each
  double time_s = 0;  // of the run
};

struct Judged {
  const char* name;
  double Figures::*figure;
  bool is_relative;
  double goal;  // per cent, or degrees
};
constexpr std::array kJudged = {
    Judged{"height", &Figures::height, true, 5}, Judged{"radius", &Figures::radius, true, 3},
    Judged{"angle", &Figures::angle, false, 1.5}, Judged{"packing", &Figures::packing, true, 3}};

struct Layout {
  std::string name;
  std::array<int, 3> count;
  double crate_m = 0;  // inner width; 0: no crate
  double duration_s;
  bool has_funnel = false;
};

Layout layout_of(const std::string& name, double volume_m3) {
  if (name == "plane125") return {name, {5, 5, 5}, 0, 4};
  if (name == "plane512") return {name, {8, 8, 8}, 0, 5};
  if (name == "funnel125") return {name, {5, 5, 5}, 0, 7, true};
  if (name != "crate200") {
    throw Error(ErrorKind::usage, Problem{.found = "the scene '" + name + "'",
                                          .expected = "plane125, plane512, crate200 or funnel125"});
  }
  const double width = std::max(std::cbrt(200 * volume_m3 / 0.5), 8 * kRadius);
  const int across = static_cast<int>((width - 2 * (kRadius + kJitter)) / kSpacing) + 1;
  return {name, {across, (200 + across * across - 1) / (across * across), across}, width, 6};
}

Scene scene_of(const Layout& layout, const fs::path& mesh, const fs::path& signature, int seed,
               bool statistical) {
  Scene scene;
  scene.name = layout.name;
  scene.seed = static_cast<uint64_t>(seed);
  scene.frame_rate = 60;
  scene.step_s = statistical ? 1.0 / 60 : 1.0 / 240;
  scene.simulator.mode = statistical ? SimulatorMode::statistical : SimulatorMode::impulse;
  if (statistical) scene.simulator.solver_iterations = 8;
  scene.materials["stuff"] = {kRestitution, kFriction, 500};
  scene.shapes["ground"] = PlaneShape{};
  MeshShape shape{.file = mesh};
  shape.collision = CollisionKind::decomposition;
  if (statistical) shape.signature = signature;
  scene.shapes["body"] = shape;
  scene.bodies.push_back(
      {.name = "ground", .shape = "ground", .material = "stuff", .role = Role::fixed});
  if (layout.crate_m > 0) {
    scene.shapes["crate"] = BinShape{{layout.crate_m, 3 * layout.crate_m, layout.crate_m}, kFloor};
    scene.bodies.push_back(
        {.name = "crate", .shape = "crate", .material = "stuff", .role = Role::fixed});
  }
  if (layout.has_funnel) {
    MeshShape funnel{.file = PILESIM_SOURCE_DIR "/presets/hard/funnel.obj",
                     .scale = Vec3::Constant(kFunnelScale)};
    funnel.collision = CollisionKind::mesh;
    scene.shapes["funnel"] = funnel;
    Body body{.name = "funnel", .shape = "funnel", .material = "stuff", .role = Role::fixed};
    body.pose.position.y() = kOutlet;
    scene.bodies.push_back(body);
  }
  Emitter emitter{.name = "bodies", .shapes = {"body"}, .material = "stuff"};
  const double lowest = layout.has_funnel ? kOutlet + kFunnelHeight : 0.4;
  emitter.source = GridSource{{0, lowest + kSpacing * layout.count[1] / 2, 0},
                              layout.count,
                              {kSpacing, kSpacing, kSpacing}};
  emitter.position_jitter_m = kJitter;
  emitter.angular_velocity_jitter = 2;
  scene.emitters.push_back(emitter);
  return scene;
}

Figures run(const Scene& scene, const Layout& layout) {
  const Model model = build_model(scene);
  const auto simulator = make_simulator(scene, model);
  const auto begin = std::chrono::steady_clock::now();
  const int frames = static_cast<int>(layout.duration_s * scene.frame_rate);
  for (int frame = 0; frame < frames; ++frame) simulator->step_frame();
  Figures f;
  f.time_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  const double ground = layout.crate_m > 0 ? kFloor : 0;
  std::vector<Vec3> places;
  std::vector<double> heights;
  double volume = 0;
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    if (model.bodies[i].role != Role::dynamic) continue;
    places.emplace_back(simulator->states().position[i] - ground * Vec3::UnitY());
    heights.push_back(places.back().y());
    volume += model.shapes[model.bodies[i].shape].mass.volume_m3;
  }
  std::ranges::sort(heights);
  const auto count = static_cast<double>(places.size());
  const double lowest = heights[static_cast<size_t>(0.005 * count)];
  const double wide = 2 * kRadius;
  double above = 0;
  // Height of the highest centre above the lowest, m.
  std::map<std::pair<int, int>, double> columns;
  for (const Vec3& p : places) {
    f.height += p.y() / count;
    above += std::max(0.0, p.y() - lowest) / count;
    f.radius += std::hypot(p.x(), p.z()) / count;
    double& top = columns[{static_cast<int>(std::floor(p.x() / wide)),
                           static_cast<int>(std::floor(p.z() / wide))}];
    top = std::max(top, p.y() - lowest);
  }
  // Averaged over the volume of a cone of radius R and height H, the radius is R/2 and the height
  // H/4.
  f.angle = degrees(std::atan2(2 * above, f.radius));
  double room = 0;
  for (const auto& [cell, top] : columns) room += wide * wide * (top + 2 * lowest);
  f.packing = volume / room;
  return f;
}

class Reference {
 public:
  explicit Reference(const fs::path& file) : file_(file) {
    std::ifstream in(file);
    std::string line;
    while (std::getline(in, line)) {
      std::istringstream fields(line);
      std::string key;
      Figures f;
      fields >> key >> f.height >> f.radius >> f.angle >> f.packing >> f.time_s;
      known_[key] = f;
    }
  }
  template <class Run>
  Figures of(const std::string& key, const Run& run) {
    const auto [place, is_new] = known_.try_emplace(key);
    if (is_new) {
      place->second = run();
      const Figures& f = place->second;
      std::ofstream(file_, std::ios::app) << key << ' ' << f.height << ' ' << f.radius << ' '
                                          << f.angle << ' ' << f.packing << ' ' << f.time_s << '\n';
    }
    return place->second;
  }

 private:
  fs::path file_;
  std::map<std::string, Figures> known_;
};

struct Spread {
  double mean = 0, deviation = 0;
};

Spread spread_of(const std::vector<Figures>& runs, double Figures::*figure) {
  Spread s;
  const auto count = static_cast<double>(runs.size());
  for (const Figures& f : runs) s.mean += f.*figure / count;
  for (const Figures& f : runs) s.deviation += std::pow(f.*figure - s.mean, 2) / (count - 1);
  s.deviation = std::sqrt(s.deviation);
  return s;
}

// The size of an error, the probability that chance alone keeps it within the goal (for means of
// other runs of the reference, and of this mode if its figure were right), and the deviation of one
// run of the reference.
struct ShapeError {
  double size = 0, again = 0, right = 0, own = 0;
};
// By scene and figure, for each shape.
using Errors = std::map<std::string, std::array<std::vector<ShapeError>, kJudged.size()>>;

// Probability that the difference of two means of this many runs is within the goal.
double chance_within(double goal, double deviation_a, double deviation_b, int runs) {
  return std::erf(goal / (std::sqrt(2.0 / runs) * std::hypot(deviation_a, deviation_b)));
}

void judge(const NamedSolid& solid, const Options& options, Reference& reference, Errors& errors) {
  const fs::path mesh = fs::absolute(options.output / (solid.name + ".obj"));
  TriangleMesh scaled = solid.mesh;
  for (Vec3& v : scaled.vertices) v *= kRadius;
  write_obj(scaled, mesh);
  const fs::path signature = fs::absolute(options.output / (solid.name + ".sig"));
  if (!fs::exists(signature)) {
    SignatureOptions sampling{.mesh = mesh};
    sampling.material = {.restitution = kRestitution, .friction = kFriction};
    measure_signature(sampling, signature);
  }
  const Packing packing = *read_signature(signature).packing;
  std::printf("%s: a ball of %.3f R, resistance to rolling %.3f, turning %.3f and %.3f\n",
              solid.name.c_str(), packing.radius_m / kRadius, packing.rolling, packing.turning,
              packing.leaning);
  const double volume = mass_properties(scaled).volume_m3;
  for (const std::string& name : options.scenes) {
    const Layout layout = layout_of(name, volume);
    std::vector<Figures> exact, drawn;
    for (int seed = 1; seed <= options.seeds; ++seed) {
      const std::string key = solid.name + "/" + name + "/" + std::to_string(seed);
      exact.push_back(reference.of(
          key, [&] { return run(scene_of(layout, mesh, signature, seed, false), layout); }));
      drawn.push_back(run(scene_of(layout, mesh, signature, seed, true), layout));
    }
    std::printf("%-12s %-9s", solid.name.c_str(), name.c_str());
    for (size_t i = 0; i < kJudged.size(); ++i) {
      const Judged& judged = kJudged[i];
      const Spread a = spread_of(exact, judged.figure), b = spread_of(drawn, judged.figure);
      const double unit = judged.is_relative ? 100 / a.mean : 1;
      const double error = unit * (b.mean - a.mean);
      const double own = unit * a.deviation, other = unit * b.deviation;
      errors[name][i].push_back({std::abs(error),
                                 chance_within(judged.goal, own, own, options.seeds),
                                 chance_within(judged.goal, own, other, options.seeds), own});
      std::printf("  %7.3f %+5.1f%s (%4.1f, %4.1f)", a.mean, error, judged.is_relative ? "%" : "",
                  own, other);
    }
    std::printf("  %.2f and %.2f s\n", exact[0].time_s, drawn[0].time_s);
    std::fflush(stdout);
  }
}

void sum_up(Errors& errors) {
  for (auto& [scene, figures] : errors) {
    // With fewer bodies the reference itself varies more.
    const double most = scene.ends_with("125") ? 2 : 3;
    for (size_t i = 0; i < kJudged.size(); ++i) {
      std::vector<ShapeError>& all = figures[i];
      std::ranges::sort(all, {}, &ShapeError::size);
      double again = 0, right = 0;
      for (const ShapeError& error : all) {
        again += error.again;
        right += error.right;
      }
      const auto within =
          std::ranges::upper_bound(all, kJudged[i].goal, {}, &ShapeError::size) - all.begin();
      const auto like_own =
          std::ranges::count_if(all, [&](const ShapeError& e) { return e.size <= most * e.own; });
      std::printf(
          "%-9s %-8s %td of %zu within %.1f; median %.1f, nine of ten below %.1f; by chance alone "
          "%.1f would be if right, and %.1f other runs of the reference; %td within %.0f of the "
          "reference's own deviations\n",
          scene.c_str(), kJudged[i].name, within, all.size(), kJudged[i].goal,
          all[all.size() / 2].size, all[all.size() * 9 / 10].size, right, again, like_own, most);
    }
  }
}

// The assets, scaled to the size of the generated solids.
NamedSolid asset(const std::string& name) {
  const fs::path file = fs::path(PILESIM_SOURCE_DIR "/assets") / (name + ".obj");
  return {name, of_radius_1(import_mesh(file))};
}

void run_all(int argc, char** argv) {
  Options options;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "-o") {
      options.output = argv[++i];
    } else if (word == "--seeds") {
      options.seeds = std::atoi(argv[++i]);
    } else if (word == "--scene") {
      options.scenes.emplace_back(argv[++i]);
    } else {
      options.names.push_back(word);
    }
  }
  if (options.scenes.empty()) options.scenes = {"plane125", "plane512", "crate200", "funnel125"};
  fs::create_directories(options.output);
  std::vector<NamedSolid> solids = solid_families();
  for (const char* name : {"rabbit", "l_shape", "box", "ring", "banana", "biped", "book", "chair",
                           "cross", "stick", "tyre"}) {
    solids.push_back(asset(name));
  }
  std::printf(
      "%-12s %-9s  height, m               radius, m               angle, degrees"
      "           packing\n",
      "shape", "scene");
  Reference reference(options.output / "reference.csv");
  Errors errors;
  for (const NamedSolid& solid : solids) {
    const std::vector<std::string>& names = options.names;
    if (!names.empty() && std::ranges::find(names, solid.name) == names.end()) continue;
    judge(solid, options, reference, errors);
  }
  sum_up(errors);
}

}  // namespace
}  // namespace pilesim

int main(int argc, char** argv) {
  return pilesim::report_errors([&] { pilesim::run_all(argc, argv); });
}
