// Scenes in the statistical mode, with signatures measured by the test.
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "geometry/obj_writer.h"
#include "geometry/primitives.h"
#include "signature/signature_file.h"
#include "signature/signature_sampling.h"
#include "support/coarse_signature.h"
#include "support/plain_packing.h"
#include "support/scene_run.h"
#include "support/scratch_directory.h"

namespace pilesim::test {

// Each has its own directory and removes it.
class StatisticalScene : public SceneRun {
 protected:
  static constexpr double kRestitution = 0.3, kFriction = 0.5;

  StatisticalScene() {
    scene_.name = "test";
    scene_.step_s = 1.0 / 60;
    scene_.simulator.mode = SimulatorMode::statistical;
    scene_.simulator.solver_iterations = 8;
    scene_.materials["stuff"] = {kRestitution, kFriction, 1000};
    scene_.shapes["ground"] = PlaneShape{};
  }

  // A shape named `name` with the signature of the mesh.
  void add_shape(const std::string& name, const TriangleMesh& mesh,
                 double restitution = kRestitution) {
    const std::filesystem::path file = directory_ / (name + ".obj");
    write_obj(mesh, file);
    SignatureOptions options =
        coarse_options({.restitution = restitution, .friction = kFriction}, 6, 6);
    options.mesh = file;
    const std::filesystem::path signature = directory_ / (name + ".sig");
    Signature measured = sample_signature(options).signature;
    measured.packing = plain_packing(measured, mesh);
    write_signature(measured, signature);
    MeshShape shape{.file = file};
    shape.signature = signature;
    scene_.shapes[name] = shape;
  }

  // Changes the packing in the signature of a shape.
  void change_packing(const std::string& shape, const std::function<void(Packing&)>& change) {
    const auto& file = *std::get<MeshShape>(scene_.shapes.at(shape)).signature;
    Signature signature = read_signature(file);
    change(*signature.packing);
    write_signature(signature, file);
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

  ScratchDirectory directory_;
};

}  // namespace pilesim::test
