#include "job/measured_signatures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
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
#include "model/model_shapes.h"
#include "packing/packing_measurement.h"
#include "signature/signature_document.h"
#include "signature/signature_sampling.h"
#include "signature/trial/contact_body.h"
#include "simulate/modes/make_simulator.h"

namespace pilesim {
namespace {

using nlohmann::json;

// One seed for all measurements: the scene's seed must not change signatures.
constexpr uint64_t kSeed = 1;
// A third of sample-signature's default: docs/lab/signatures.md.
constexpr uint32_t kTrialsPerCell = 20;
constexpr uint32_t kSpherePours = 1;

// The surface of the solid that carries the mass: the drawn mesh may be open.
TriangleMesh solid_of(const ModelShape& shape, const MeshShape* mesh) {
  if (mesh == nullptr) return shape.mesh;
  MeshLibrary meshes;
  const Vec3 scale = mesh->size_m ? Vec3(Vec3::Constant(shape.file_scale)) : mesh->scale;
  const TriangleMesh& drawn = meshes.load(mesh->file, scale, shape.file_up);
  TriangleMesh solid = make_solid(drawn, solid_options(*mesh), user_cache_directory()).mesh;
  const Vec3 centre = mass_properties(solid).centre_of_mass;
  for (Vec3& vertex : solid.vertices) vertex -= centre;
  return solid;
}

MeasuredObject object_of(const Scene& scene, const ModelShape& shape, const Material& material) {
  const auto* mesh = std::get_if<MeshShape>(&scene.shapes.at(shape.source));
  return {.shape = shape,
          .mesh = mesh,
          .solid = solid_of(shape, mesh),
          .material = {.restitution = material.restitution, .friction = material.friction}};
}

// The collision shape in pours. Meshes are decomposed, however coarse the scene's collision shape
// is.
ModelShape poured_shape(const MeasuredObject& object) {
  if (object.mesh == nullptr) return object.shape;
  Scene decomposed;
  MeshShape mesh = *object.mesh;
  mesh.collision = CollisionKind::decomposition;
  mesh.decomposition_max_pieces = MeshShape().decomposition_max_pieces;
  mesh.decomposition_max_volume_error = MeshShape().decomposition_max_volume_error;
  decomposed.shapes[object.shape.source] = mesh;
  MeshLibrary meshes;
  return build_shape(decomposed, object.shape.source, meshes);
}

// A key of everything that determines a signature.
std::string cache_key(const MeasuredObject& object) {
  Hasher key;
  const std::string program = program_hash();
  key.add(std::as_bytes(std::span(program)));
  add_mesh(key, object.solid);
  const MassProperties& mass = object.shape.mass;
  key.add_values(std::span<const double>(mass.inertia_m5.data(), 9));
  const std::array numbers{mass.volume_m3, object.material.restitution, object.material.friction};
  key.add_values(std::span<const double>(numbers));
  if (object.mesh != nullptr) {
    const std::array most_vertices{object.mesh->hull_max_vertices};
    key.add_values(std::span<const int>(most_vertices));
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
                          piece.size.z(),
                          piece.round.bottom,
                          piece.round.top,
                          piece.round.height,
                          piece.round.end_x,
                          piece.round.end_z,
                          piece.round.hole,
                          piece.round.margin};
    key.add_values(std::span<const double>(pose));
    add_mesh(key, piece.hull);
  }
  return key.digest();
}

// The signature of a `size` times larger object. Only lengths depend on scale.
std::shared_ptr<const Signature> in_size(const std::shared_ptr<const Signature>& own, double size) {
  if (size == 1 || !own) return own;
  auto other = std::make_shared<Signature>(*own);
  SignatureBody& body = other->body;
  body.scale *= size;
  body.volume_m3 *= std::pow(size, 3);
  body.inertia_m2 *= std::pow(size, 2);
  body.gyration_m *= size;
  body.outer_radius_m *= size;
  CollisionHeightTable& heights = other->heights;
  for (auto* lengths_m : {&heights.mean_m, &heights.deviation_m, &heights.error_m}) {
    for (float& length_m : *lengths_m) length_m *= static_cast<float>(size);
  }
  for (KnownRestPose& pose : other->rest_poses) pose.height_m *= size;
  if (other->packing) other->packing->radius_m *= size;
  return other;
}

std::shared_ptr<const Signature> cached(const std::optional<CacheFile>& file) {
  std::shared_ptr<const Signature> signature;
  if (!file) return signature;
  file->load([&](const json& content) {
    signature = std::make_shared<const Signature>(signature_of(content));
  });
  return signature;
}

std::optional<CacheFile> cache_file(const std::string& key) {
  const auto directory = user_cache_directory();
  return directory ? std::optional(CacheFile(*directory, "signature", key)) : std::nullopt;
}

// Name of a progress stage, with letters that JSON need not escape.
std::string stage_of(const std::string& shape, const char* stage) {
  std::string text = shape + ": " + stage;
  for (char& letter : text) {
    const bool is_plain = letter >= ' ' && letter <= '~' && letter != '"' && letter != '\\';
    if (!is_plain) letter = '?';
  }
  return text;
}

[[noreturn]] void rethrow_at(const std::string& pointer, const Error& error) {
  std::vector<Problem> problems = error.problems();
  if (error.kind() == ErrorKind::interrupted) {
    problems = {{.found = "interrupted while its signature was measured",
                 .remedy = "The same command measures it again"}};
  }
  for (Problem& problem : problems) {
    if (problem.pointer.empty() && error.kind() != ErrorKind::io) problem.pointer = pointer;
  }
  throw Error(error.kind(), std::move(problems));
}

struct Missing {
  MeasuredObject object;
  std::string key;
};

// Measured by this process, or by another one that measures it at the moment. Adds the time of a
// measurement to `measuring_s`.
std::shared_ptr<const Signature> measured(const Missing& missing, const MeasureSettings& settings,
                                          double& measuring_s) {
  const auto& [object, key] = missing;
  const std::optional<CacheFile> file = cache_file(key);
  std::optional<CacheLock> lock;
  if (file) {
    lock.emplace(*file, [&] {
      if (!settings.say) return;
      settings.say("another run of pilesim measures the signature of " + object.shape.name +
                   ": this one waits for it");
    });
    if (auto signature = cached(file)) return signature;
  }
  const Stopwatch watch;
  const json document = signature_document(settings.measure(object, settings.progress));
  if (file) file->store(document);
  measuring_s += watch.seconds();
  // Round numbers as a file would.
  return std::make_shared<const Signature>(signature_of(document));
}

// Uses the cache, and calls `measure`, if set, for missing signatures; returns the time for that.
double fill(const Scene& scene, Model& model, const MeasureSettings& settings) {
  std::vector<Missing> missing;
  std::map<std::string, std::shared_ptr<const Signature>> known;  // by key: materials may be equal
  std::map<ObjectKey, std::string> keys;
  for (const ObjectKey& of : objects_to_measure(scene, model)) {
    const auto shape = std::ranges::find_if(model.shapes, [&](const ModelShape& other) {
      return other.source == model.shapes[of.first].source && other.size == 1;
    });
    MeasuredObject object = object_of(scene, *shape, model.materials[of.second]);
    const std::string& key = keys[of] = cache_key(object);
    if (!known.contains(key)) {
      known[key] = cached(cache_file(key));
      if (!known[key]) missing.push_back({std::move(object), key});
    }
  }
  const auto put = [&] {
    for (const auto& [of, key] : keys) {
      model.signatures[of] = in_size(known[key], model.shapes[of.first].size);
    }
  };
  put();
  if (missing.empty() || !settings.measure) return 0;
  // The mode checks the scene before any measurement.
  make_simulator(scene, model);
  double measuring_s = 0;
  for (const Missing& one : missing) {
    try {
      known[one.key] = measured(one, settings, measuring_s);
    } catch (const Error& error) {
      rethrow_at(shape_pointer(one.object.shape.source), error);
    }
  }
  put();
  return measuring_s;
}

}  // namespace

Signature measure_object(const MeasuredObject& object, ProgressMode progress) {
  const SampledObject sampled{
      .name = object.shape.name,
      .hull = simplified_hull(object.solid.vertices, static_cast<int>(kMaxHullVertices)),
      .mass = object.shape.mass};
  SignatureOptions options{.material = object.material, .seed = kSeed};
  options.sampling = {.trials_per_cell = kTrialsPerCell, .exemplars = kTrialsPerCell};
  options.accuracy.reset();
  options.progress = progress;
  options.stage = stage_of(object.shape.name, "sampling");
  Signature signature = sample_signature(options, sampled).signature;
  const PouredObject poured{.shape = poured_shape(object),
                            .material = {.restitution = object.material.restitution,
                                         .friction = object.material.friction},
                            .outer_radius_m = signature.body.outer_radius_m,
                            .volume_m3 = signature.body.volume_m3};
  signature.packing = measure_packing(poured, signature,
                                      {.sphere_pours = kSpherePours,
                                       .seed = kSeed,
                                       .progress = progress,
                                       .stage = stage_of(object.shape.name, "pouring")});
  return signature;
}

double measure_signatures(const Scene& scene, Model& model, const MeasureSettings& settings) {
  return fill(scene, model, settings);
}

void find_signatures(const Scene& scene, Model& model) { fill(scene, model, {.measure = {}}); }

std::string describe_unkept_signatures(const Scene& scene, const Model& model) {
  if (user_cache_directory() || objects_to_measure(scene, model).empty()) return {};
  return "signatures are measured for each run, since no cache directory can be written; name one "
         "in XDG_CACHE_HOME";
}

}  // namespace pilesim
