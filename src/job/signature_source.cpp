#include "job/signature_source.h"

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include "core/error.h"
#include "geometry/mesh_import.h"
#include "json/codec.h"
#include "scene/scene_loader.h"

namespace pilesim {
namespace {

// Names of the materials with which bodies that move freely use each shape.
std::map<std::string, std::set<std::string>> materials_of_shapes(const Scene& scene) {
  std::map<std::string, std::set<std::string>> materials;
  for (const Body& body : scene.bodies) {
    if (body.role == Role::dynamic) materials[body.shape].insert(body.material);
  }
  for (const Emitter& emitter : scene.emitters) {
    for (size_t i = 0; i < emitter.shapes.size(); ++i) {
      const bool has_own = i < emitter.materials.size();
      materials[emitter.shapes[i]].insert(has_own ? emitter.materials[i] : emitter.material);
    }
  }
  return materials;
}

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
  const auto materials = materials_of_shapes(scene);
  std::vector<std::string> meshes;  // that move
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
  const std::set<std::string>& used = materials.at(name);
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
  if (mesh.scale != Vec3::Constant(mesh.scale.x()) || mesh.scale.x() < 0) {
    refuse(scene_file, "shape \"" + name + "\" is stretched or mirrored by its scale",
           "one scale, above 0",
           R"(Leave "signature" out: then it is measured when it is needed)");
  }
  options.scale = mesh.size_m ? *mesh.size_m / import_mesh(mesh.file, 1).bounds().sizes().maxCoeff()
                              : mesh.scale.x();
  options.is_z_up = mesh.up == UpAxis::z;
  options.material.restitution = material.restitution;
  options.material.friction = material.friction;
  static constexpr SolidRule kRules[] = {SolidRule::automatic, SolidRule::exact, SolidRule::wrap,
                                         SolidRule::hull};
  options.solid = {.rule = kRules[static_cast<size_t>(mesh.solid)],
                   .thickness_m = mesh.thickness_m,
                   .hull_max_vertices = mesh.hull_max_vertices};
}

}  // namespace pilesim
