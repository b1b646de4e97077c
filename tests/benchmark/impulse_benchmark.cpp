// Time of the impulse mode beside a plain Bullet driver, both in one run, frame by frame in turn:
//   impulse_benchmark [BODIES [STEP_HZ [SWEEPS [REPEATS [MESH]]]]]
// Hulls of 40 vertices of one mesh fall in a cubic grid onto a plane: 420 frames at 60 Hz. The
// plain driver is the world of Bullet's manual: its default settings, one thread, the same hulls,
// places, masses, steps and sweeps of the solver (Bullet's default is 10, pilesim's 20).
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include <sys/resource.h>

#include "core/error.h"
#include "geometry/convex_hull.h"
#include "geometry/mesh_import.h"
#include "report/machine_info.h"
#include "report_errors.h"
#include "simulate/bullet/bullet_types.h"
#include "simulate/modes/make_simulator.h"
#include "simulate/simulator.h"
#include "support/small_model.h"

namespace pilesim {
namespace {

constexpr int kFrames = 420;
constexpr double kFrameRate = 60;
constexpr int kHullVertices = 40;
constexpr double kDiameter =
    2;  // m, of a body's bounding ball: Bullet's defaults are made for such sizes

struct Setup {
  SmallModel small;
  int step_hz;
};

// The mesh's hull about its centre of mass, scaled to the diameter above.
ModelShape hull_shape(const std::string& file) {
  ModelShape shape;
  shape.name = file;
  shape.mesh = simplified_hull(import_mesh(file).vertices, kHullVertices);
  const Vec3 centre = mass_properties(shape.mesh).centre_of_mass;
  double radius = 0;
  for (Vec3& vertex : shape.mesh.vertices) radius = std::max(radius, (vertex -= centre).norm());
  for (Vec3& vertex : shape.mesh.vertices) vertex *= kDiameter / 2 / radius;
  shape.mass = mass_properties(shape.mesh);
  shape.bounding_radius = kDiameter / 2;
  shape.smallest_extent = shape.mesh.bounds().sizes().minCoeff();
  shape.pieces.push_back({CollisionPiece::Kind::hull, {}, {}, shape.mesh});
  return shape;
}

void fill(Setup& setup, const ModelShape& shape, int bodies) {
  SmallModel& m = setup.small;
  m.scene.frame_rate = kFrameRate;
  m.scene.step_s = 1.0 / setup.step_hz;
  const uint32_t material = m.material(0.1, 0.5);
  m.body(m.plane(), material, Vec3::Zero(), Role::fixed);
  m.model.shapes.push_back(shape);
  const auto index = static_cast<uint32_t>(m.model.shapes.size() - 1);
  const int side = static_cast<int>(std::ceil(std::cbrt(bodies)));
  for (int i = 0; i < bodies; ++i) {
    const Vec3 cell(i % side, i / (side * side), i / side % side);
    // Turned a little, each in its own way, so that columns do not stay columns.
    const Quat turn(Eigen::AngleAxisd(0.7 * i, Vec3(std::sin(i), std::cos(i), 0.5).normalized()));
    m.body(index, material, kDiameter * 1.1 * (cell + Vec3(0, 1, 0))).pose.orientation = turn;
  }
}

struct Result {
  double seconds = 0;
  StageTimes stages;
  double deepest_m = 0;
  double kinetic_j = 0;
  int awake = 0;
};

double now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

class PilesimDriver {
 public:
  explicit PilesimDriver(const Setup& setup)
      : simulator_(make_simulator(setup.small.scene, setup.small.model)) {}

  void step_frame(Result& result) {
    const FrameStatistics frame = simulator_->step_frame();
    result.stages += frame.times;
    result.deepest_m = frame.deepest_penetration_m;
    result.kinetic_j = frame.kinetic_energy_j;
    result.awake = static_cast<int>(frame.bodies_awake);
  }

 private:
  std::unique_ptr<Simulator> simulator_;
};

class PlainDriver {
 public:
  explicit PlainDriver(const Setup& setup)
      : step_s_(1.0 / setup.step_hz), steps_(setup.step_hz / static_cast<int>(kFrameRate)) {
    const Model& model = setup.small.model;
    world_.setGravity(to_bullet(setup.small.scene.gravity));
    world_.getSolverInfo().m_numIterations = setup.small.scene.simulator.solver_iterations;
    for (const Vec3& vertex : model.shapes.back().mesh.vertices) hull_.addPoint(to_bullet(vertex));
    for (const ModelBody& source : model.bodies) {
      const bool fixed = source.role == Role::fixed;
      btCollisionShape* shape = fixed ? static_cast<btCollisionShape*>(&plane_) : &hull_;
      btVector3 inertia(0, 0, 0);
      if (!fixed) hull_.calculateLocalInertia(source.mass_kg, inertia);
      btRigidBody::btRigidBodyConstructionInfo info(source.mass_kg, nullptr, shape, inertia);
      info.m_startWorldTransform = to_bullet(source.pose);
      info.m_friction = std::sqrt(0.5);
      info.m_restitution = std::sqrt(0.1);
      bodies_.push_back(std::make_unique<btRigidBody>(info));
      world_.addRigidBody(bodies_.back().get());
    }
  }
  ~PlainDriver() {
    for (const auto& body : bodies_) world_.removeRigidBody(body.get());
  }
  PlainDriver(const PlainDriver&) = delete;
  PlainDriver& operator=(const PlainDriver&) = delete;

  void step_frame() {
    for (int step = 0; step < steps_; ++step) world_.stepSimulation(step_s_, 0);
  }

  void describe(Result& result) {
    for (const auto& body : bodies_) {
      if (body->getInvMass() == 0 || !body->isActive()) continue;
      ++result.awake;
      result.kinetic_j += body->getLinearVelocity().length2() / (2 * body->getInvMass());
    }
    for (int m = 0; m < dispatcher_.getNumManifolds(); ++m) {
      const btPersistentManifold& manifold = *dispatcher_.getManifoldByIndexInternal(m);
      for (int p = 0; p < manifold.getNumContacts(); ++p) {
        result.deepest_m =
            std::max<double>(result.deepest_m, -manifold.getContactPoint(p).getDistance());
      }
    }
  }

 private:
  double step_s_;
  int steps_;
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  btDbvtBroadphase broad_phase_;
  btSequentialImpulseConstraintSolver solver_;
  btDiscreteDynamicsWorld world_{&dispatcher_, &broad_phase_, &solver_, &configuration_};
  btStaticPlaneShape plane_{{0, 1, 0}, 0};
  btConvexHullShape hull_;
  std::vector<std::unique_ptr<btRigidBody>> bodies_;
};

// Frame by frame in turn, so that a machine that is slow for a while is slow for both.
void run_both(const Setup& setup, Result& pilesim, Result& plain) {
  PilesimDriver ours(setup);
  PlainDriver theirs(setup);
  for (int frame = 0; frame < kFrames; ++frame) {
    const double start = now_s();
    ours.step_frame(pilesim);
    const double middle = now_s();
    theirs.step_frame();
    pilesim.seconds += middle - start;
    plain.seconds += now_s() - middle;
  }
  theirs.describe(plain);
}

double median(std::vector<double> values) {
  std::ranges::sort(values);
  return values[values.size() / 2];
}

void run(int argc, char** argv) {
  const int bodies = argc > 1 ? std::atoi(argv[1]) : 100;
  const int step_hz = argc > 2 ? std::atoi(argv[2]) : 240;
  Setup setup{{}, step_hz};
  int& sweeps = setup.small.scene.simulator.solver_iterations;
  if (argc > 3) sweeps = std::atoi(argv[3]);
  const int repeats = argc > 4 ? std::atoi(argv[4]) : 5;
  const std::string mesh = argc > 5 ? argv[5] : PILESIM_SOURCE_DIR "/assets/rabbit.obj";
  if (bodies < 1 || sweeps < 1 || repeats < 1 || step_hz < kFrameRate || step_hz % 60 != 0) {
    throw Error(ErrorKind::usage,
                Problem{.found = "an argument out of range",
                        .remedy = "impulse_benchmark [BODIES [STEP_HZ, a multiple of 60 [SWEEPS "
                                  "[REPEATS [MESH]]]]]"});
  }
  fill(setup, hull_shape(mesh), bodies);
  std::vector<Result> ours, plain;
  for (int i = 0; i < repeats; ++i) {
    run_both(setup, ours.emplace_back(), plain.emplace_back());
  }
  std::vector<double> seconds, plain_seconds, ratios;
  for (size_t i = 0; i < ours.size(); ++i) {
    seconds.push_back(ours[i].seconds);
    plain_seconds.push_back(plain[i].seconds);
    ratios.push_back(ours[i].seconds / plain[i].seconds);
  }
  const Result& a = ours.back();
  const Result& b = plain.back();
  const MachineInfo machine = machine_info();
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const double steps = kFrames * step_hz / kFrameRate;
  std::printf("%s, %s\n", machine.cpu.c_str(), machine.system.c_str());
  std::printf("%d bodies, step 1/%d s, %d sweeps, %d frames, median of %d\n", bodies, step_hz,
              sweeps, kFrames, repeats);
  std::printf("pilesim       %8.2f s, ratio to plain Bullet %.2f (%.2f to %.2f)\n", median(seconds),
              median(ratios), std::ranges::min(ratios), std::ranges::max(ratios));
  std::printf("plain Bullet  %8.2f s\n", median(plain_seconds));
  std::printf("ms a step     broad %.3f, narrow %.3f, solver %.3f, integration %.3f, other %.3f\n",
              1e3 * a.stages.of(Stage::broad_phase) / steps,
              1e3 * a.stages.of(Stage::narrow_phase) / steps,
              1e3 * a.stages.of(Stage::solver) / steps,
              1e3 * a.stages.of(Stage::integration) / steps, 1e3 * a.stages.other_s() / steps);
  std::printf(
      "at the end    deepest %.2g m (plain %.2g m), kinetic %.2g J (plain %.2g J), awake %d "
      "(plain %d)\n",
      a.deepest_m, b.deepest_m, a.kinetic_j, b.kinetic_j, a.awake, b.awake);
  std::printf("peak memory   %.0f MB, of both drivers\n",
              static_cast<double>(usage.ru_maxrss) / 1024);
}

}  // namespace
}  // namespace pilesim

int main(int argc, char** argv) {
  return pilesim::report_errors([&] { pilesim::run(argc, argv); });
}
