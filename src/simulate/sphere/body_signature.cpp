#include "simulate/sphere/body_signature.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/naming.h"
#include "core/printable.h"
#include "core/text.h"
#include "geometry/convex_hull.h"
#include "model/model_shapes.h"
#include "signature/signature_file.h"
#include "simulate/sphere/sphere_constants.h"

namespace pilesim {
namespace {

using namespace sphere_constants;

// Smaller differences of restitution and friction count as equal.
constexpr double kSameMaterial = 1e-3;
// Roots of moments that differ by less than this, relative to the radius of gyration, count as
// equal.
constexpr double kLikeMoments = 1e-6;

// The command that measures it for the scene.
std::string sampling_command(const ModelShape& shape, const std::string& output) {
  return "pilesim sample-signature --scene " + std::string(kNamedFile) + " --shape " +
         shell_word(shape.source) + " -o " + shell_word(output);
}

void check(const ModelShape& shape, const Material& material, const Signature& signature) {
  const std::string file = shape.signature_file.string();
  const auto refuse = [&](const std::string& found, const std::string& expected) {
    throw Error(ErrorKind::input, {.pointer = shape_pointer(shape.name) + "/signature",
                                   .found = "is \"" + file + "\", " + found,
                                   .expected = expected,
                                   .remedy = "Leave \"signature\" out, or measure it again: " +
                                             sampling_command(shape, file) + " --force"});
  };
  if (signature.body.mesh_hash != shape.mesh_hash) {
    refuse("a signature of another mesh or scale (" + signature.body.mesh + ", scale " +
               std::to_string(signature.body.scale) + ")",
           "one of the shape's own mesh");
  }
  if (!signature.packing) {
    refuse("a signature that does not say how its object packs",
           "one with a packing (pilesim inspect shows it), made without --pours 0");
  }
  if (std::abs(signature.material.restitution - material.restitution) > kSameMaterial ||
      std::abs(signature.material.friction - material.friction) > kSameMaterial) {
    refuse("a signature measured with restitution " +
               std::to_string(signature.material.restitution) + " and friction " +
               std::to_string(signature.material.friction),
           "the body's material: restitution " + std::to_string(material.restitution) +
               ", friction " + std::to_string(material.friction));
  }
}

Signature read_signature_of(const ModelShape& shape) {
  try {
    return read_signature(shape.signature_file);
  } catch (const Error& error) {
    if (error.kind() != ErrorKind::input) throw;
    std::vector<Problem> problems = error.problems();
    for (Problem& problem : problems) {
      problem.remedy =
          "Measure it again: " + sampling_command(shape, shape.signature_file.string()) +
          " --force";
    }
    throw Error(error.kind(), std::move(problems));
  }
}

// For programs that have not measured it (job/measured_signatures.h).
Error no_signature(const ModelShape& shape, const ModelBody& body) {
  return {ErrorKind::input,
          Problem{.pointer = shape_pointer(shape.name),
                  .found = "the shape of '" + body.name + "' has no signature",
                  .expected = "one, since it collides by it in this /simulator/mode",
                  .remedy = "Measure one, and name its file in \"signature\": " +
                            sampling_command(shape, shape.source + ".sig")}};
}

void set_sphere(BodySignature& body, double radius_m, double rolling) {
  body.packing_radius_m = static_cast<float>(radius_m);
  body.rolling = static_cast<float>(rolling);
  body.interlocking = static_cast<float>(1 + kInterlocking * rolling);
}

void set_spin_measure(const SignatureBody& measured, BodySignature& body) {
  const Vec3 scale = measured.inertia_m2.cwiseSqrt() / measured.gyration_m;
  if (scale.maxCoeff() - scale.minCoeff() < kLikeMoments) return;
  const Mat3 axes = measured.principal_axes.toRotationMatrix();
  body.to_spin = Mat3(axes * scale.asDiagonal() * axes.transpose()).cast<float>();
  body.to_angular_velocity =
      Mat3(axes * scale.cwiseInverse().asDiagonal() * axes.transpose()).cast<float>();
}

// From geometry alone, for objects without a signature.
BodySignature particle(const ModelShape& shape) {
  BodySignature body;
  const double volume_m3 = shape.mass.volume_m3;
  // 3 k^2 = the sum of the moments
  body.gyration_m = static_cast<float>(std::sqrt(shape.mass.inertia_m5.trace() / (3 * volume_m3)));
  body.outer_radius_m = static_cast<float>(shape.bounding_radius);
  const double hull_m3 = mass_properties(convex_hull(shape.mesh.vertices)).volume_m3;
  // A concave body takes more space than its volume, but others enter its hull.
  const double packed_m3 = volume_m3 * std::pow(hull_m3 / volume_m3, kHullShare);
  const double unlike_ball = 1 - shape.smallest_extent / (2 * shape.bounding_radius);
  const double radius_m = std::cbrt(3 * packed_m3 / (4 * kPi));
  set_sphere(body, radius_m, kRolling * unlike_ball);
  return body;
}

}  // namespace

BodySignatures particle_spheres(const Model& model) {
  BodySignatures result;
  for (const ModelBody& body : model.bodies) {
    if (body.role != Role::dynamic) continue;
    const auto [object, is_new] = result.try_emplace({body.shape, body.material});
    if (is_new) object->second = particle(model.shapes[body.shape]);
  }
  return result;
}

BodySignature body_signature(std::shared_ptr<const Signature> signature, const Packing& packing) {
  BodySignature body;
  body.gyration_m = static_cast<float>(signature->body.gyration_m);
  body.outer_radius_m = static_cast<float>(signature->body.outer_radius_m);
  if (spin_measure(signature->responses.layout) == SpinMeasure::energy) {
    set_spin_measure(signature->body, body);
  }
  set_sphere(body, packing.radius_m, packing.rolling);
  body.turning = static_cast<float>(packing.turning);
  body.leaning = static_cast<float>(packing.leaning);
  body.rebound = static_cast<float>(packing.rebound);
  body.rest_targets = rest_targets(signature->rest_poses);
  body.responses.emplace(*signature);
  body.signature = std::move(signature);
  return body;
}

BodySignatures load_signatures(const Model& model) {
  return load_signatures(model, [](const ModelBody&) { return true; });
}

std::vector<ObjectKey> objects_to_measure(const Model& model,
                                          const std::function<bool(const ModelBody&)>& collides) {
  std::set<ObjectKey> objects;
  for (const ModelBody& body : model.bodies) {
    if (body.role != Role::dynamic || !collides(body)) continue;
    if (model.shapes[body.shape].signature_file.empty()) {
      objects.emplace(body.shape, body.material);
    }
  }
  return {objects.begin(), objects.end()};
}

BodySignatures load_signatures(const Model& model,
                               const std::function<bool(const ModelBody&)>& collides) {
  BodySignatures result;
  std::map<std::string, std::shared_ptr<const Signature>> files;
  for (const ModelBody& body : model.bodies) {
    if (body.role != Role::dynamic) continue;
    BodySignature& object = result[{body.shape, body.material}];
    if (!collides(body) || object.outer_radius_m > 0) continue;
    const ModelShape& shape = model.shapes[body.shape];
    if (shape.signature_file.empty()) {
      const auto measured = model.signatures.find({body.shape, body.material});
      if (measured == model.signatures.end()) throw no_signature(shape, body);
      object = measured->second ? body_signature(measured->second, *measured->second->packing)
                                : particle(shape);
      continue;
    }
    if (!std::filesystem::exists(shape.signature_file)) {
      const std::string file = shape.signature_file.string();
      throw Error(ErrorKind::input,
                  {.pointer = shape_pointer(shape.name) + "/signature",
                   .found = "is \"" + file + "\", which does not exist",
                   .expected = "a signature of the shape's mesh",
                   .remedy = "Leave \"signature\" out, and it is measured when it is needed; or "
                             "measure it: " +
                             sampling_command(shape, file)});
    }
    std::shared_ptr<const Signature>& signature = files[shape.signature_file.string()];
    if (!signature) {
      signature = std::make_shared<const Signature>(read_signature_of(shape));
    }
    check(shape, model.materials[body.material], *signature);
    object = body_signature(signature, *signature->packing);
  }
  return result;
}

std::vector<std::string> describe_signatures(const Model& model, const BodySignatures& objects) {
  std::vector<std::string> lines;
  for (const auto& [key, object] : objects) {
    const ModelShape& shape = model.shapes[key.first];
    const Material& material = model.materials[key.second];
    const std::string of_material = "restitution " + with_digits(material.restitution, 6) +
                                    " and friction " + with_digits(material.friction, 6);
    if (!object.signature) {
      if (!model.signatures.contains(key)) continue;  // a particle
      lines.push_back(shape.name + ": its signature for " + of_material +
                      " is to be measured when it is simulated");
      continue;
    }
    const ResponseTable& table = object.signature->responses;
    const std::string kind =
        object.signature->fit ? "fitted splines"
        : table.exemplar_count > 0
            ? "tables, " + std::to_string(table.exemplar_count) + " exemplars a cell"
            : "tables";
    lines.push_back(shape.name + ": " +
                    (shape.signature_file.empty() ? "measured for " + of_material
                                                  : shape.signature_file.filename().string()) +
                    ", " + kind + "; as large as a ball of " +
                    with_digits(object.packing_radius_m, 3) + " m among other bodies");
  }
  return lines;
}

}  // namespace pilesim
