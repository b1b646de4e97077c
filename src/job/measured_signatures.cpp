#include "job/measured_signatures.h"

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/checkpoint_file.h"
#include "core/clock.h"
#include "core/error.h"
#include "core/hash.h"
#include "geometry/cache_file.h"
#include "geometry/convex_hull.h"
#include "geometry/mass_properties.h"
#include "geometry/solid.h"
#include "job/rest_drops.h"
#include "model/model_shapes.h"
#include "packing/packing_measurement.h"
#include "signature/signature_document.h"
#include "signature/signature_sampling.h"
#include "simulate/modes/make_simulator.h"

namespace pilesim {
namespace {

using nlohmann::json;

// Of all measurements: the scene's seed changes no signature.
constexpr uint64_t kSeed = 1;

// What is measured, in the body frame.
struct Object {
  const ModelShape& shape;
  const MeshShape* mesh;  // null: the shape is no mesh
  TriangleMesh solid;
  ContactMaterial material;
};

// The surface of what has mass: the drawn mesh may be open.
TriangleMesh solid_of(const ModelShape& shape, const MeshShape* mesh) {
  if (mesh == nullptr) return shape.mesh;
  MeshLibrary meshes;
  const TriangleMesh& drawn = meshes.load(mesh->file, shape.file_scale * shape.size, shape.file_up);
  TriangleMesh solid = make_solid(drawn, solid_options(*mesh), user_cache_directory()).mesh;
  const Vec3 centre = mass_properties(solid).centre_of_mass;
  for (Vec3& vertex : solid.vertices) vertex -= centre;
  return solid;
}

Object object_of(const Scene& scene, const Model& model, const ObjectKey& key) {
  const ModelShape& shape = model.shapes[key.first];
  const Material& material = model.materials[key.second];
  const auto* mesh = std::get_if<MeshShape>(&scene.shapes.at(shape.source));
  return {.shape = shape,
          .mesh = mesh,
          .solid = solid_of(shape, mesh),
          .material = {.restitution = material.restitution, .friction = material.friction}};
}

// As it collides in pours. Meshes are decomposed, however coarsely the scene has them collide.
ModelShape poured_shape(const Object& object) {
  if (object.mesh == nullptr) return object.shape;
  Scene decomposed;
  MeshShape mesh = *object.mesh;
  mesh.collision = CollisionKind::decomposition;
  decomposed.shapes[object.shape.source] = mesh;
  MeshLibrary meshes;
  ModelShape shape = build_shape(decomposed, object.shape.source, meshes);
  return object.shape.size == 1 ? shape : resized(shape, object.shape.size);
}

// All that a signature follows from.
std::string cache_key(const Object& object, const MeasuringEffort& effort) {
  Hasher key;
  const std::string program = program_hash();
  key.add(std::as_bytes(std::span(program)));
  add_mesh(key, object.solid);
  const MassProperties& mass = object.shape.mass;
  key.add_values(std::span<const double>(mass.inertia_m5.data(), 9));
  const std::array numbers{mass.volume_m3, object.material.restitution, object.material.friction};
  key.add_values(std::span<const double>(numbers));
  const std::array counts{effort.trials_per_cell, effort.rest_drops,    effort.pours,
                          effort.rounds,          effort.pours_a_round, effort.pours_of_result};
  key.add_values(std::span<const uint32_t>(counts));
  if (object.mesh != nullptr) {
    const std::array options{static_cast<double>(object.mesh->hull_max_vertices),
                             static_cast<double>(object.mesh->decomposition_max_pieces),
                             object.mesh->decomposition_max_volume_error};
    key.add_values(std::span<const double>(options));
    return key.digest();
  }
  for (const CollisionPiece& piece : object.shape.pieces) {
    const std::array pose{static_cast<double>(piece.kind),
                          piece.pose.position.x(),
                          piece.pose.position.y(),
                          piece.pose.position.z(),
                          piece.pose.orientation.w(),
                          piece.pose.orientation.x(),
                          piece.pose.orientation.y(),
                          piece.pose.orientation.z(),
                          piece.size.x(),
                          piece.size.y(),
                          piece.size.z()};
    key.add_values(std::span<const double>(pose));
    add_mesh(key, piece.hull);
  }
  return key.digest();
}

Signature measure(const Object& object, ProgressMode progress, const MeasuringEffort& effort) {
  const SampledObject sampled{.name = object.shape.name,
                              .hull = convex_hull(object.solid.vertices),
                              .mass = object.shape.mass};
  SignatureOptions options{.material = object.material, .seed = kSeed};
  options.sampling = {.trials_per_cell = effort.trials_per_cell,
                      .exemplars = effort.trials_per_cell};
  options.accuracy.reset();
  options.progress = progress;
  options.drop_to_rest = [&](const TriangleMesh& hull) {
    return drop_to_rest(hull, sampled.mass,
                        {.drops = effort.rest_drops,
                         .material = object.material,
                         .seed = kSeed,
                         .progress = progress})
        .rests;
  };
  Signature signature = sample_signature(options, sampled).signature;
  const PouredObject poured{.shape = poured_shape(object),
                            .material = {.restitution = object.material.restitution,
                                         .friction = object.material.friction},
                            .outer_radius_m = signature.body.outer_radius_m,
                            .volume_m3 = signature.body.volume_m3};
  signature.packing = measure_packing(poured, signature,
                                      {.pours = effort.pours,
                                       .rounds = effort.rounds,
                                       .pours_a_round = effort.pours_a_round,
                                       .pours_of_result = effort.pours_of_result,
                                       .seed = kSeed,
                                       .progress = progress});
  return signature;
}

std::shared_ptr<const Signature> cached(const std::optional<CacheFile>& file) {
  std::shared_ptr<const Signature> signature;
  if (!file) return signature;
  file->load([&](const json& content) {
    auto read = std::make_shared<const Signature>(signature_of(content));
    if (read->packing) signature = std::move(read);
  });
  return signature;
}

std::optional<CacheFile> cache_file(const std::string& key) {
  const auto directory = user_cache_directory();
  return directory ? std::optional(CacheFile(*directory, "signature", key)) : std::nullopt;
}

// Measures what is not in the cache where there is an effort; returns the time for it.
double fill(const Scene& scene, Model& model, ProgressMode progress, const MeasuringEffort& effort,
            bool measures) {
  struct Missing {
    ObjectKey of;
    std::string key;
    Object object;
  };
  std::vector<Missing> missing;
  std::map<std::string, std::shared_ptr<const Signature>> known;  // by key: materials may be alike
  for (const ObjectKey& of : objects_to_measure(scene, model)) {
    Object object = object_of(scene, model, of);
    const std::string key = cache_key(object, effort);
    if (!known.contains(key)) known[key] = cached(cache_file(key));
    model.signatures[of] = known[key];
    if (!known[key]) missing.push_back({of, key, std::move(object)});
  }
  if (missing.empty() || !measures) return 0;
  // What the mode refuses, it refuses before anything is measured.
  make_simulator(scene, model);
  const Stopwatch watch;
  for (const auto& [of, key, object] : missing) {
    std::shared_ptr<const Signature>& signature = known[key];
    if (!signature) {
      const std::string pointer = shape_pointer(object.shape.source);
      try {
        const json document = signature_document(measure(object, progress, effort));
        // Numbers are rounded in files.
        signature = std::make_shared<const Signature>(signature_of(document));
        if (const auto file = cache_file(key)) file->store(document);
      } catch (const Error& error) {
        if (error.kind() != ErrorKind::input) throw;
        std::vector<Problem> problems = error.problems();
        for (Problem& problem : problems) {
          if (problem.pointer.empty()) problem.pointer = pointer;
        }
        throw Error(error.kind(), std::move(problems));
      }
    }
    model.signatures[of] = signature;
  }
  return watch.seconds();
}

}  // namespace

double measure_signatures(const Scene& scene, Model& model, ProgressMode progress,
                          const MeasuringEffort& effort) {
  return fill(scene, model, progress, effort, true);
}

void find_signatures(const Scene& scene, Model& model) {
  fill(scene, model, ProgressMode::none, {}, false);
}

}  // namespace pilesim
