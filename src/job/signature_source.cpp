#include "job/signature_source.h"

#include <algorithm>
#include <string>
#include <variant>
#include <vector>

#include "core/error.h"
#include "core/printable.h"
#include "json/codec.h"
#include "model/model_shapes.h"
#include "scene/moving_shapes.h"
#include "scene/scene_loader.h"

namespace pilesim {
namespace {

[[noreturn]] void refuse(const std::filesystem::path& file, const std::string& found,
                         const std::string& expected, const std::string& remedy) {
  throw Error(
      ErrorKind::usage,
      Problem{.file = file.string(), .found = found, .expected = expected, .remedy = remedy});
}

// Names of shapes of moving bodies, at least one.
std::vector<std::string> moving_meshes(const Scene& scene, const std::filesystem::path& file) {
  std::vector<std::string> meshes;
  for (const auto& [name, materials] : moving_shapes(scene)) {
    if (std::holds_alternative<MeshShape>(scene.shapes.at(name))) meshes.push_back(name);
  }
  if (meshes.empty()) {
    refuse(file, "no body that moves has a mesh", "a shape of type \"mesh\"",
           "Name a mesh file in place of the scene");
  }
  return meshes;
}

// Bodies with joints are solved contact by contact, in all modes that have joints.
bool is_always_joined(const Scene& scene, const std::string& shape) {
  const auto is_free = [&](const Body& body) {
    if (body.role != Role::dynamic || body.shape != shape) return false;
    return std::ranges::none_of(scene.joints, [&](const Joint& joint) {
      return joint.a == body.name || joint.b == body.name;
    });
  };
  return std::ranges::none_of(scene.bodies, is_free) &&
         std::ranges::none_of(scene.emitters, [&](const Emitter& emitter) {
           return std::ranges::find(emitter.shapes, shape) != emitter.shapes.end();
         });
}

}  // namespace

void refuse_scene_as_mesh(const std::filesystem::path& scene_file, const std::string& output) {
  const std::vector<std::string> meshes = moving_meshes(load_scene(scene_file).scene, scene_file);
  refuse(scene_file, "is a scene",
         "a mesh, or --scene and one of the shapes " + quoted_list(meshes),
         "Write: pilesim sample-signature --scene " + shell_word(scene_file.string()) +
             " --shape " + shell_word(meshes.front()) + " -o " + shell_word(output));
}

void take_from_scene(const std::filesystem::path& scene_file, const std::string& shape,
                     SignatureOptions& options) {
  const Scene scene = load_scene(scene_file).scene;
  const std::vector<std::string> meshes = moving_meshes(scene, scene_file);
  if (shape.empty() && meshes.size() > 1) {
    refuse(scene_file, "has several meshes that move", "one of " + quoted_list(meshes),
           "Say which: --shape " + meshes.front());
  }
  const std::string name = shape.empty() ? meshes.front() : shape;
  if (std::ranges::find(meshes, name) == meshes.end()) {
    refuse(scene_file,
           "--shape \"" + name + "\" is " +
               (scene.shapes.contains(name) ? "not the mesh of a body that moves" : "no shape"),
           "one of " + quoted_list(meshes), "");
  }
  const auto used = moving_shapes(scene).at(name);
  if (used.size() > 1) {
    refuse(scene_file,
           "shape \"" + name + "\" is used with the materials " +
               quoted_list({used.begin(), used.end()}),
           "one material, which the signature is measured with",
           "Give each material a shape of its own, with its own signature");
  }
  if (is_always_joined(scene, name)) {
    refuse(scene_file,
           "all bodies of shape \"" + name +
               "\" have joints, and no mode uses signatures of such bodies",
           "a shape of bodies without joints",
           "Measure the mesh alone: name its file in place of the scene");
  }
  const Material& material = scene.materials.at(*used.begin());
  const auto& mesh = std::get<MeshShape>(scene.shapes.at(name));
  options.mesh = mesh.file;
  if (!is_uniform(mesh.scale)) {
    refuse(scene_file, "shape \"" + name + "\" is stretched or mirrored by its scale",
           "one scale, above 0", R"(Leave "signature" out: then it is measured when it is needed)");
  }
  MeshLibrary library;
  options.scale = mesh.size_m ? scale_to(*mesh.size_m, mesh.file, library) : mesh.scale.x();
  options.is_z_up = mesh.up == UpAxis::z;
  options.material.restitution = material.restitution;
  options.material.friction = material.friction;
  options.solid = solid_options(mesh);
}

}  // namespace pilesim
