// Scenes in the statistical mode, with signatures that are measured on the spot.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "geometry/obj_writer.h"
#include "geometry/primitives.h"
#include "signature/signature_file.h"
#include "signature/signature_sampling.h"
#include "simulate/simulator.h"

namespace pilesim::test {

// Each in a directory of its own, which it removes.
class StatisticalScene : public testing::Test {
 protected:
  static constexpr double kRestitution = 0.3, kFriction = 0.5;

  StatisticalScene() {
    std::string pattern = (std::filesystem::temp_directory_path() / "statistical.XXXXXX").string();
    EXPECT_NE(mkdtemp(pattern.data()), nullptr);
    directory_ = pattern;
    scene_.name = "test";
    scene_.step_s = 1.0 / 60;
    scene_.simulator.mode = SimulatorMode::statistical;
    scene_.simulator.solver_iterations = 8;
    scene_.materials["stuff"] = {kRestitution, kFriction, 1000};
    scene_.shapes["ground"] = PlaneShape{};
  }
  ~StatisticalScene() override { std::filesystem::remove_all(directory_); }

  // A shape named `name` with the signature of the mesh.
  void add_shape(const std::string& name, const TriangleMesh& mesh,
                 double restitution = kRestitution) {
    const std::filesystem::path file = directory_ / (name + ".obj");
    write_obj(mesh, file);
    SignatureOptions options{.mesh = file};
    options.material = {.restitution = restitution, .friction = kFriction};
    options.sampling = {.trials_per_cell = 6, .exemplars = 6};
    options.accuracy.reset();
    options.progress = ProgressMode::none;
    const std::filesystem::path signature = directory_ / (name + ".sig");
    write_signature(sample_signature(options).signature, signature);
    MeshShape shape{.file = file};
    shape.signature = signature;
    scene_.shapes[name] = shape;
  }

  void add_ground() {
    scene_.bodies.push_back(
        {.name = "ground", .shape = "ground", .material = "stuff", .role = Role::fixed});
  }

  Body& add_body(const std::string& shape, const Vec3& position) {
    Body body{
        .name = shape + std::to_string(scene_.bodies.size()), .shape = shape, .material = "stuff"};
    body.pose.position = position;
    scene_.bodies.push_back(body);
    return scene_.bodies.back();
  }

  void add_grid(const std::string& shape, const std::array<int, 3>& count, const Vec3& spacing,
                const Vec3& centre) {
    Emitter emitter{.name = "grid", .shapes = {shape}, .material = "stuff"};
    emitter.source = GridSource{centre, count, spacing};
    emitter.position_jitter_m = 0.02;
    scene_.emitters.push_back(emitter);
  }

  void start() {
    model_ = build_model(scene_);
    simulator_ = make_simulator(scene_, model_);
  }
  FrameStatistics run(int frames) {
    FrameStatistics statistics;
    for (int i = 0; i < frames; ++i) statistics = simulator_->step_frame();
    return statistics;
  }
  const BodyStates& states() const { return simulator_->states(); }

  std::filesystem::path directory_;
  Scene scene_;
  Model model_;
  std::unique_ptr<Simulator> simulator_;
};

}  // namespace pilesim::test
