// Packings against experiments (docs/lab/nature.md has the results and their limits):
//   nature_benchmark [-o DIRECTORY] [--seeds N] [--friction MU] [--dice N] [--cycles N]
//                    [--tube D] [--bodies N] [--step HZ] [--threads N]
//                    [--mode impulse|bullet|statistical]... [NAME...]
// Pours the five Platonic solids into a wide cup, and spheres, cylinders and Raschig rings into
// tubes, and shakes them. Names are tetrahedron, cube, octahedron, dodecahedron, icosahedron,
// sphere, cylinder and raschig. Tubes are D body diameters wide, and beds have N bodies. Prints
// tables and writes them to beds.csv, profiles.csv and profiles.png. Every run is kept as a scene
// and a trajectory, which `pilesim render` draws. An existing run of the same scene is measured
// again without a new simulation: remove the directory after a change of the engine.
//
// Bodies have a volume of d^3 (dice), or a diameter of d (beds), d = 25 mm. Rigid bodies under
// Coulomb friction have no scale of length or stress, so lengths are in d and times in sqrt(d / g).
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/gnuplot.h"
#include "core/parallel_for.h"
#include "core/philox.h"
#include "core/text.h"
#include "geometry/obj_writer.h"
#include "geometry/primitives.h"
#include "inspect/pile_inspection.h"
#include "job/rest_drops.h"
#include "job/simulation_job.h"
#include "report/machine_info.h"
#include "report_errors.h"
#include "scene/scene_loader.h"
#include "support/measured_profiles.h"
#include "support/measured_signature.h"
#include "support/packed_solids.h"
#include "support/packing.h"
#include "trajectory/trajectory.h"

namespace pilesim {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr double kDiameter = 0.025;       // d, m
constexpr double kGravity = 9.81;         // m/s^2
constexpr double kRestitution = 0.2;      // of all pairs
constexpr double kFrameRate = 30;         // frames a second
constexpr int kCupSides = 64;             // of the polygon that stands for the tube
constexpr double kDiceCup = 10;           // its diameter, d
constexpr double kBedTube = 5;            // default, d
constexpr double kSettling = 30;          // sqrt(d / g), after the last body and after shaking
constexpr double kAmplitude = 0.15;       // of shaking, d
constexpr double kPeakAcceleration = 3;   // of shaking, g
constexpr double kMargin = 1.5;           // of the bulk from walls, floor and surface, d
constexpr int kKeysACycle = 16;           // the sine is linear in between
constexpr uint64_t kPoints = 400'000;     // per volume
constexpr uint64_t kPointsABin = 20'000;  // per ring of the profile
constexpr int kRingsADiameter = 20;       // of the profile, per diameter
const double kTime = std::sqrt(kDiameter / kGravity);  // s

// One kind of body. Experiments: see docs/lab/nature.md.
struct Kind {
  std::string name;
  int faces = 0;                // of a Platonic solid; 0: a bed in a tube
  double expected_fill;         // only for the bodies' initial height
  double loose = 0, dense = 0;  // Baker and Kudrolli 2010, both +- 0.01
  double porosity = 0;          // of the bed: Benyahia and O'Neill 2005
  int bed_bodies = 0;
};

// Outer diameter and height d; the hole's radius as a share of the outer one.
constexpr double kHole = 0.6;
constexpr int kRingSides = 16;

// Benyahia and O'Neill 2005, as cited by the library `fluids` (packed_bed.py). `ratio`: the tube's
// diameter over that of a ball of the body's volume.
double sphere_porosity(double ratio) { return 0.390 + 1.740 / std::pow(ratio + 1.140, 2); }
double cylinder_porosity(double ratio) { return 0.373 + 1.703 / std::pow(ratio + 0.611, 2); }
double any_porosity(double ratio, double sphericity) {
  return 0.1504 + 0.2024 / sphericity + 1.0814 / std::pow(ratio + 0.1226, 2);
}

std::vector<Kind> kinds(double tube) {
  const double cylinder_ball = std::cbrt(1.5);  // d; pi / 4 of d^3
  const double ring_volume = kPi / 4 * (1 - kHole * kHole);
  const double ring_area = kPi * (1 + kHole) + kPi / 2 * (1 - kHole * kHole);
  const double ring_ball = std::cbrt(6 * ring_volume / kPi);
  const double ring_sphericity = kPi * ring_ball * ring_ball / ring_area;
  return {
      {.name = "tetrahedron", .faces = 4, .expected_fill = 0.5, .loose = 0.51, .dense = 0.64},
      {.name = "cube", .faces = 6, .expected_fill = 0.5, .loose = 0.54, .dense = 0.67},
      {.name = "octahedron", .faces = 8, .expected_fill = 0.5, .loose = 0.52, .dense = 0.64},
      {.name = "dodecahedron", .faces = 12, .expected_fill = 0.5, .loose = 0.51, .dense = 0.63},
      {.name = "icosahedron", .faces = 20, .expected_fill = 0.5, .loose = 0.50, .dense = 0.59},
      {.name = "sphere",
       .expected_fill = 0.52,
       .porosity = sphere_porosity(tube),
       .bed_bodies = 350},
      {.name = "cylinder",
       .expected_fill = 0.5,
       .porosity = cylinder_porosity(tube / cylinder_ball),
       .bed_bodies = 320},
      {.name = "raschig",
       .expected_fill = 0.32,
       .porosity = any_porosity(tube / ring_ball, ring_sphericity),
       .bed_bodies = 310},
  };
}

struct Options {
  fs::path output = "out/nature";
  int seeds = 3;
  double friction = 0.5;
  int dice = 400;
  double tube = kBedTube;
  int bodies = 0;  // of a bed; 0: the kind's default
  int cycles = 150;
  int step_hz = 240;
  std::vector<std::string> modes, names;
};

TriangleMesh mesh_of(const Kind& kind) {
  TriangleMesh mesh = kind.faces > 0           ? platonic_solid(kind.faces)
                      : kind.name == "sphere"  ? sphere_mesh(0.5)
                      : kind.name == "raschig" ? ring_mesh(0.5, 0.5 * kHole, 1, kRingSides)
                                               : ring_mesh(0.5, 0, 1, 32);
  for (Vec3& vertex : mesh.vertices) vertex *= kDiameter;
  return mesh;
}

double outer_radius(const TriangleMesh& mesh) {
  double radius = 0;
  for (const Vec3& vertex : mesh.vertices) radius = std::max(radius, vertex.norm());
  return radius;
}

// Measured once; the file's name identifies all its inputs.
fs::path signature_of(const Kind& kind, const Options& options) {
  const fs::path mesh = options.output / "shapes" / (kind.name + ".obj");
  const fs::path file =
      options.output / "shapes" / (kind.name + "_" + with_digits(options.friction, 3) + ".sig");
  if (fs::exists(file)) return file;
  SignatureOptions sampling{.mesh = mesh};
  sampling.material = {.restitution = kRestitution, .friction = options.friction};
  sampling.drop_to_rest = [&](const TriangleMesh& checked) {
    return drop_to_rest(checked, {.drops = 300,
                                  .material = sampling.material,
                                  .seed = sampling.seed,
                                  .progress = ProgressMode::none})
        .rests;
  };
  measure_signature(sampling, file);
  return file;
}

json numbers(const Vec3& v) { return {v.x(), v.y(), v.z()}; }

// Times of a run, s.
struct Schedule {
  double poured = 0, rested = 0, shaken = 0, end = 0;
};

struct Case {
  const Kind& kind;
  std::string mode;
  int seed;
  int bodies;
  double tube;  // diameter, d
  fs::path directory;

  int rings() const { return static_cast<int>(std::lround(kRingsADiameter * tube / 2)); }
};

// Layers of bodies that cannot touch, each starting two bodies' radii above the bed's current top,
// so that bodies fall about two diameters: one emitter per body.
double pour(const Case& one, double radius, double volume, json& emitters) {
  const double free_radius = one.tube * kDiameter / 2 - 1.02 * radius;
  const double area = kPi * std::pow(one.tube * kDiameter / 2, 2);
  const double period = 1.2 * std::sqrt(2 * 2 * radius / kGravity);  // to fall out of the way
  Philox random(static_cast<uint64_t>(one.seed), Stream::test, 1);
  double start = 0;
  int poured = 0;
  while (poured < one.bodies) {
    const double surface = poured * volume / (one.kind.expected_fill * area);
    const double height = surface + 2 * radius + kDiameter;
    std::vector<Vec3> layer;
    for (int tries = 0; tries < 200 && poured < one.bodies; ++tries) {
      const double r = free_radius * std::sqrt(random.uniform());
      const double angle = 2 * kPi * random.uniform();
      const Vec3 place(r * std::cos(angle), height, r * std::sin(angle));
      const Quat turn = random.rotation();
      const bool clear = std::ranges::all_of(
          layer, [&](const Vec3& other) { return (place - other).norm() > 2.02 * radius; });
      if (!clear) continue;
      layer.push_back(place);
      emitters.push_back({{"name", "body " + std::to_string(poured)},
                          {"type", "stream"},
                          {"shape", "body"},
                          {"material", "plastic"},
                          {"position", numbers(place)},
                          {"orientation", {turn.w(), turn.x(), turn.y(), turn.z()}},
                          {"count", 1},
                          {"rate_hz", 1},
                          {"start_s", start}});
      ++poured;
    }
    start += period;
  }
  return start;
}

// A sine of the cup's height whose amplitude vanishes over the last quarter.
json shaking(double start, int cycles, double& end) {
  const double turn_rate = std::sqrt(kPeakAcceleration / kAmplitude) / kTime;  // rad/s
  json keys = json::array();
  const int last = cycles * kKeysACycle;
  for (int key = 0; key <= last; ++key) {
    const double phase = 2 * kPi * key / kKeysACycle;
    const double left = std::min(1.0, 4.0 * (last - key) / last);
    end = start + phase / turn_rate;
    const double y = kAmplitude * kDiameter * left * std::sin(phase);
    keys.push_back({{"time_s", end}, {"position", {0, y, 0}}});
  }
  return keys;
}

Schedule make_scene(const Case& one, const Options& options, std::string& scene_text) {
  const TriangleMesh mesh = mesh_of(one.kind);
  const double radius = outer_radius(mesh);
  const double volume = mass_properties(mesh).volume_m3;
  const double area = kPi * std::pow(one.tube * kDiameter / 2, 2);
  const double height = one.bodies * volume / (0.7 * one.kind.expected_fill * area) + 8 * radius;
  const fs::path shapes = fs::absolute(options.output / "shapes");
  const fs::path cup = shapes / (one.kind.name + "_cup.obj");
  write_obj(cup_mesh(one.tube * kDiameter / 2, height, kDiameter, kCupSides), cup);

  json body = {{"type", "mesh"}, {"file", (shapes / (one.kind.name + ".obj")).string()}};
  if (one.mode == "statistical") {
    body["signature"] = fs::absolute(signature_of(one.kind, options)).string();
  } else if (one.kind.name == "sphere") {
    body = {{"type", "sphere"}, {"radius", kDiameter / 2}};
  } else if (one.kind.name == "cylinder") {
    body = {{"type", "cylinder"}, {"radius", kDiameter / 2}, {"height", kDiameter}};
  }
  if (one.kind.name == "raschig") {
    body["collision"] = "decomposition";
    body["decomposition_max_pieces"] = kRingSides;
    body["decomposition_max_volume_error"] = 0.001;
  }

  Schedule schedule;
  json emitters = json::array();
  schedule.poured = pour(one, radius, volume, emitters);
  schedule.rested = schedule.shaken = schedule.poured + kSettling * kTime;
  json cup_body = {{"name", "cup"},
                   {"shape", "cup"},
                   {"material", "plastic"},
                   {"role", "kinematic"},
                   {"colour", "#9aa4ad"}};
  cup_body["motion"] = shaking(schedule.rested, options.cycles, schedule.shaken);
  schedule.end = schedule.shaken + kSettling * kTime;
  // From above, with the rim as wide as the picture.
  const double above = 2 * height + one.tube * kDiameter;
  const double view = 2 * std::atan(0.75 * one.tube * kDiameter / (above - height));
  const json scene = {
      {"version", 1},
      {"name", one.kind.name + ", " + one.mode},
      {"seed", one.seed},
      {"duration_s", schedule.end + 1 / kFrameRate},
      {"frame_rate", kFrameRate},
      {"gravity", {0, -kGravity, 0}},
      {"materials", {{"plastic", {{"restitution", kRestitution}, {"friction", options.friction}}}}},
      {"shapes",
       {{"body", body},
        {"cup", {{"type", "mesh"}, {"file", cup.string()}, {"collision", "mesh"}}}}},
      {"bodies", json::array({cup_body})},
      {"emitters", emitters},
      {"step_s", 1.0 / options.step_hz},
      {"simulator",
       {{"mode", one.mode == "statistical" ? "statistical" : "impulse"},
        {"engine", one.mode == "bullet" ? "bullet" : "exact"}}},
      {"camera",
       {{"position", {0.0, above, 0.25 * one.tube * kDiameter}},
        {"target", {0, height, 0}},
        {"field_of_view_deg", degrees(view)}}}};
  scene_text = scene.dump(1) + '\n';
  return schedule;
}

// A bed at one moment.
struct Bed {
  double height = 0;  // d
  Fill bulk;          // kMargin from the wall, the floor and the surface
  Fill whole;         // from wall to wall, kMargin from floor and surface
  std::vector<double> profile;
  PileQuality quality;
  uint32_t awake = 0;
};

Bed measure(const Case& one, const Scene& scene, const Model& model, TrajectoryReader& reader,
            double time_s) {
  TrajectoryFrame frame;
  // The last frame before that time: shaking begins when rest ends.
  const auto index = static_cast<uint64_t>(time_s * kFrameRate);
  reader.read(std::min(index, reader.frame_count() - 1), frame);
  BodyStates states;
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    states.position.push_back(frame.position[i]);
    states.orientation.push_back(frame.orientation[i].cast<double>().normalized());
  }
  states.linear_velocity.assign(model.bodies.size(), Vec3::Zero());
  states.angular_velocity = states.linear_velocity;
  states.flags = frame.state;

  Bed bed;
  const PackedBodies packing(model, states.position, states.orientation, states.flags);
  const double height = bed_height_m(packing, 0);
  const double margin = kMargin * kDiameter;
  Column whole{one.tube * kDiameter / 2, margin, height - margin};
  Column bulk = whole;
  bulk.radius_m -= margin;
  bed.height = height / kDiameter;
  bed.whole = fill_of(packing, whole, kPoints);
  bed.bulk = fill_of(packing, bulk, kPoints);
  bed.profile = porosity_from_wall(packing, whole, one.rings(), kPointsABin);
  bed.quality = inspect_pile(model, scene.gravity, states);
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    bed.awake += model.bodies[i].role == Role::dynamic && (states.flags[i] & kPresent) &&
                 !(states.flags[i] & kAsleep);
  }
  return bed;
}

struct Result {
  Bed loose, shaken;
  double wall_s = 0;
};

std::string text_of(const fs::path& file) {
  std::ifstream stream(file);
  return {std::istreambuf_iterator<char>(stream), {}};
}

Result run(const Case& one, const Options& options) {
  std::string text;
  const Schedule schedule = make_scene(one, options, text);
  const fs::path scene_file = one.directory / "scene.json";
  const bool is_there = text_of(scene_file) == text && fs::exists(one.directory / "report.json");
  const auto start = std::chrono::steady_clock::now();
  if (!is_there) {
    fs::create_directories(one.directory);
    std::ofstream(scene_file) << text;
    run_simulation({.scene_file = scene_file,
                    .output = one.directory,
                    .force = true,
                    .checkpoint_period_s = 600,
                    .progress = ProgressMode::none});
  }
  Result result;
  result.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const Scene scene = load_scene(scene_file).scene;
  const Model model = build_model(scene);
  TrajectoryReader reader(one.directory);
  result.loose = measure(one, scene, model, reader, schedule.rested);
  result.shaken = measure(one, scene, model, reader, schedule.end);
  return result;
}

struct Spread {
  double mean = 0, deviation = 0;  // of a single run
};
template <class Value>
Spread spread(const std::vector<Result>& results, const Value& value) {
  const auto runs = static_cast<double>(results.size());
  Spread got;
  for (const Result& result : results) got.mean += value(result) / runs;
  for (const Result& result : results) got.deviation += std::pow(value(result) - got.mean, 2);
  got.deviation = runs > 1 ? std::sqrt(got.deviation / (runs - 1)) : 0;
  return got;
}

// Several runs with different seeds.
struct Summary {
  Spread bulk, covered, whole;
  std::vector<Spread> profile;
  double error = 0;    // of sampling
  double overlap = 0;  // the deepest, d
  uint64_t awake = 0, escaped = 0;

  Summary(const std::vector<Result>& results, bool shaken) {
    const auto bed = [shaken](const Result& r) -> const Bed& {
      return shaken ? r.shaken : r.loose;
    };
    bulk = spread(results, [&](const Result& r) { return bed(r).bulk.by_volume; });
    covered = spread(results, [&](const Result& r) { return bed(r).bulk.covered; });
    whole = spread(results, [&](const Result& r) { return bed(r).whole.by_volume; });
    for (size_t bin = 0; bin < bed(results.front()).profile.size(); ++bin) {
      profile.push_back(spread(results, [&](const Result& r) { return bed(r).profile[bin]; }));
    }
    for (const Result& r : results) {
      error = std::max(error, bed(r).bulk.standard_error);
      overlap = std::max(overlap, bed(r).quality.deepest_penetration_m / kDiameter);
      awake += bed(r).awake;
      escaped += bed(r).quality.escaped;
    }
  }
};

class Report {
 public:
  // Rows of a table.
  const std::string& compared() const { return compared_; }

  explicit Report(const Options& options) : options_(options) {
    beds_ << "shape,mode,packing,seeds,bulk_fill,deviation,sampling_error,bulk_covered,"
             "whole_fill,whole_deviation,published_bulk_fill,published_porosity,"
             "deepest_overlap_d,awake,escaped\n";
    profiles_ << "shape,mode,packing,from_wall_d,porosity,deviation,seeds\n";
  }

  void add(const Case& one, const std::vector<Result>& results) {
    const Kind& kind = one.kind;
    for (const bool shaken : {false, true}) {
      const Summary got(results, shaken);
      const char* packing = shaken ? "shaken" : "loose";
      const double experiment = shaken ? kind.dense : kind.loose;
      if (kind.faces > 0) {
        std::printf("| %s | %s | %s | %.3f +- %.3f | %.2f | %+.3f | %.3f | %.3f | %.4f | %llu |\n",
                    kind.name.c_str(), one.mode.c_str(), packing, got.bulk.mean, got.bulk.deviation,
                    experiment, got.bulk.mean - experiment, got.whole.mean,
                    got.bulk.mean - got.covered.mean, got.overlap,
                    static_cast<unsigned long long>(got.awake));
      } else {
        print_bed(one, packing, got);
        compare_profile(one, packing, got);
      }
      beds_ << kind.name << ',' << one.mode << ',' << packing << ',' << results.size() << ','
            << got.bulk.mean << ',' << got.bulk.deviation << ',' << got.error << ','
            << got.covered.mean << ',' << got.whole.mean << ',' << got.whole.deviation << ','
            << experiment << ',' << kind.porosity << ',' << got.overlap << ',' << got.awake << ','
            << got.escaped << '\n';
      std::string rows;
      for (size_t bin = 0; bin < got.profile.size(); ++bin) {
        const Spread& porosity = got.profile[bin];
        profiles_ << kind.name << ',' << one.mode << ',' << packing << ',' << from_wall(one, bin)
                  << ',' << porosity.mean << ',' << porosity.deviation << ',' << results.size()
                  << '\n';
        rows += with_digits(from_wall(one, bin), 4) + ' ' + with_digits(porosity.mean, 4) + ' ' +
                with_digits(porosity.deviation, 4) + '\n';
      }
      if (kind.faces > 0) continue;
      plot_.add("using 1:2:3 with yerrorlines pt 7 ps 0.3 title " +
                    quoted(kind.name + ", " + one.mode + ", " + packing),
                rows);
      has_beds_ = true;
    }
    std::fflush(stdout);
    write();
  }

 private:
  // Middle of a ring of the profile, d.
  static double from_wall(const Case& one, size_t bin) {
    return (static_cast<double>(bin) + 0.5) * one.tube / 2 / one.rings();
  }

  // Rings near the axis are small, and the tube ends there: leave out half a diameter.
  void compare_profile(const Case& one, const char* packing, const Summary& got) {
    const MeasuredProfile measured = measured_profile(one.kind.name);
    std::vector<double> porosity;
    for (const Spread& ring : got.profile) porosity.push_back(ring.mean);
    const ProfileDifference off =
        difference(measured, porosity, one.tube / 2 / one.rings(), one.tube / 2 - 0.5);
    if (off.points == 0) return;
    std::array<char, 200> line;
    std::snprintf(line.data(), line.size(), "| %s | %s | %s | %g | %.1f | %+.3f | %.3f |\n",
                  one.kind.name.c_str(), one.mode.c_str(), packing, one.tube, off.reach, off.mean,
                  off.size);
    compared_ += line.data();
  }

  // Also prints the first valley from the wall and the peak after it, each within a diameter.
  static void print_bed(const Case& one, const char* packing, const Summary& got) {
    const auto& profile = got.profile;
    const auto a_diameter = static_cast<ptrdiff_t>(kRingsADiameter);
    const auto lower = [](const Spread& a, const Spread& b) { return a.mean < b.mean; };
    const auto valley = std::min_element(profile.begin(), profile.begin() + a_diameter, lower);
    const auto left = std::min(a_diameter, profile.end() - valley);
    const auto peak = std::max_element(valley, valley + left, lower);
    const auto at = [&](auto bin) {
      return from_wall(one, static_cast<size_t>(bin - profile.begin()));
    };
    const double porosity = 1 - got.whole.mean;
    std::printf(
        "| %s | %s | %s | %.3f +- %.3f | %.3f | %+.3f | %.2f at %.2f | %.2f at %.2f | %.3f "
        "| %.4f | %llu |\n",
        one.kind.name.c_str(), one.mode.c_str(), packing, porosity, got.whole.deviation,
        one.kind.porosity, porosity - one.kind.porosity, valley->mean, at(valley), peak->mean,
        at(peak), got.bulk.mean - got.covered.mean, got.overlap,
        static_cast<unsigned long long>(got.awake));
  }

  void write() const {
    std::ofstream(options_.output / "beds.csv") << beds_.str();
    std::ofstream(options_.output / "profiles.csv") << profiles_.str();
    if (has_beds_) write_png_chart(options_.output / "profiles.png", plot_.script(), 900, 560);
  }

  const Options& options_;
  std::ostringstream beds_, profiles_;
  std::string compared_;
  Plot plot_{
      "set xlabel 'from the wall, d'\nset ylabel 'porosity'\nset yrange [0:1]\n"
      "set xrange [0:*]\nset grid\n"};
  bool has_beds_ = false;
};

Options options_of(int argc, char** argv) {
  Options options;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const auto value = [&] { return i + 1 < argc ? std::string(argv[++i]) : std::string(); };
    if (word == "-o")
      options.output = value();
    else if (word == "--seeds")
      options.seeds = std::atoi(value().c_str());
    else if (word == "--friction")
      options.friction = std::atof(value().c_str());
    else if (word == "--dice")
      options.dice = std::atoi(value().c_str());
    else if (word == "--tube")
      options.tube = std::atof(value().c_str());
    else if (word == "--bodies")
      options.bodies = std::atoi(value().c_str());
    else if (word == "--cycles")
      options.cycles = std::atoi(value().c_str());
    else if (word == "--step")
      options.step_hz = std::atoi(value().c_str());
    else if (word == "--threads")
      set_thread_count(std::max(1, std::atoi(value().c_str())));
    else if (word == "--mode")
      options.modes.push_back(value());
    else
      options.names.push_back(word);
  }
  if (options.seeds < 1 || options.dice < 1 || options.cycles < 4 || options.step_hz < 1 ||
      !(options.tube >= 2) || options.bodies < 0) {
    throw Error(ErrorKind::usage, Problem{.found = "an argument out of range",
                                          .remedy = "see the head of nature_benchmark.cpp"});
  }
  if (options.modes.empty()) options.modes = {"impulse", "statistical"};
  return options;
}

void run_all(int argc, char** argv) {
  const Options options = options_of(argc, argv);
  fs::create_directories(options.output / "shapes");
  std::printf("%s; %d seeds, friction %g, restitution %g, %d dice, %d cycles, 1/%d s\n\n",
              machine_info().cpu.c_str(), options.seeds, options.friction, kRestitution,
              options.dice, options.cycles, options.step_hz);
  Report report(options);
  double all_s = 0;
  for (const bool dice : {true, false}) {
    std::printf("%s", dice ? "| Dice | Mode | Packing | Bulk | Experiment | Difference | With "
                             "walls | Shared | Overlap, d | Awake |\n"
                             "|---|---|---|---|---|---|---|---|---|---|\n"
                           : "\n| Bed | Mode | Packing | Porosity | Correlation | Difference | "
                             "First valley | Peak behind | Shared | Overlap, d | Awake |\n"
                             "|---|---|---|---|---|---|---|---|---|---|---|\n");
    for (const Kind& kind : kinds(options.tube)) {
      const bool wanted = options.names.empty() || std::ranges::count(options.names, kind.name) > 0;
      if (!wanted || (kind.faces > 0) != dice) continue;
      write_obj(mesh_of(kind), options.output / "shapes" / (kind.name + ".obj"));
      for (const std::string& mode : options.modes) {
        // A ball's signature would belong to its mesh, whose corners the ball lacks.
        if (mode == "statistical" && kind.name == "sphere") continue;
        std::vector<Result> results;
        const int bed_bodies = options.bodies > 0 ? options.bodies : kind.bed_bodies;
        Case one{kind, mode, 1, dice ? options.dice : bed_bodies, dice ? kDiceCup : options.tube,
                 {}};
        for (one.seed = 1; one.seed <= options.seeds; ++one.seed) {
          one.directory =
              options.output / (kind.name + "_" + mode + "_" + std::to_string(one.seed));
          results.push_back(run(one, options));
          all_s += results.back().wall_s;
        }
        report.add(one, results);
      }
    }
  }
  if (!report.compared().empty()) {
    std::printf(
        "\n| Bed | Mode | Packing | Tube, d | Until, d from the wall | Porosity less measured | "
        "Absolute |\n|---|---|---|---|---|---|---|\n%s",
        report.compared().c_str());
  }
  std::printf("\n%.0f s of simulation\n", all_s);
}

}  // namespace
}  // namespace pilesim

int main(int argc, char** argv) {
  return pilesim::report_errors([&] { pilesim::run_all(argc, argv); });
}
