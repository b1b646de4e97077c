#include "job/signature_source.h"

#include <algorithm>
#include <string>
#include <variant>
#include <vector>

#include "core/error.h"
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

}  // namespace

void take_from_scene(const std::filesystem::path& scene_file, const std::string& shape,
                     SignatureOptions& options) {
  const Scene scene = load_scene(scene_file).scene;
  const auto materials = moving_shapes(scene);
  std::vector<std::string> meshes;  // of moving bodies
  for (const auto& [name, of] : materials) {
    if (std::holds_alternative<MeshShape>(scene.shapes.at(name))) meshes.push_back(name);
  }
  if (meshes.empty()) {
    refuse(scene_file, "no body that moves has a mesh", "a shape of type \"mesh\"",
           "Name a mesh file in place of --scene");
  }
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
  const auto& used = materials.at(name);
  if (used.size() > 1) {
    refuse(scene_file,
           "shape \"" + name + "\" is used with the materials " +
               quoted_list({used.begin(), used.end()}),
           "one material, which the signature is measured with",
           "Give each material a shape of its own, with its own signature");
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
