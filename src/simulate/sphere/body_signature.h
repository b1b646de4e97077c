// An object of the sphere engine: its signature and derived quantities.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "model/model.h"
#include "signature/response_model.h"
#include "signature/signature.h"
#include "simulate/sphere/rest_control.h"

namespace pilesim {

struct BodySignature {
  std::shared_ptr<const Signature> signature;  // null: a particle
  std::optional<ResponseModel> responses;      // tables or splines of the signature
  float gyration_m = 0;
  float outer_radius_m = 0;
  // Set if the moments differ and responses are by energy (SpinMeasure): body frame, k^-1 I^(1/2)
  // and its inverse.
  std::optional<Eigen::Matrix3f> to_spin, to_angular_velocity;
  // Radius of the sphere that represents the body among others: such spheres form piles of the
  // bodies' height.
  float packing_radius_m = 0;
  // Rolling resistance, in radii: a ball rolls for ever, a block does not.
  float rolling = 0;
  // How far impacts turn a body on others to a rest pose, and the rate, in sqrt(g / bounding
  // radius), at which a body that leans on a wall turns to lie against it (Packing).
  float turning = 0, leaning = 0;
  float rebound = 1;  // share that is kept of a sampled rebound from a surface
  // Factor on friction between spheres: bodies that are not balls catch on each other.
  float interlocking = 1;
  std::vector<RestTarget> rest_targets;

  // Conversion between an angular velocity, rad/s, and the spin of responses, world frame.
  Vec3f spin_of(const Quatf& orientation, const Vec3f& angular_velocity) const {
    return measured(to_spin, orientation, angular_velocity);
  }
  Vec3f angular_velocity_of(const Quatf& orientation, const Vec3f& spin) const {
    return measured(to_angular_velocity, orientation, spin);
  }

 private:
  static Vec3f measured(const std::optional<Eigen::Matrix3f>& scale, const Quatf& orientation,
                        const Vec3f& spin) {
    return scale ? Vec3f(orientation * Vec3f(*scale * (orientation.conjugate() * spin))) : spin;
  }
};

// By shape and material.
using BodySignatures = std::map<ObjectKey, BodySignature>;

// The objects of dynamic bodies that satisfy `collides` and whose shapes name no signature: their
// signatures belong into Model::signatures.
std::vector<ObjectKey> objects_to_measure(const Model& model,
                                          const std::function<bool(const ModelBody&)>& collides);

// Signatures for dynamic bodies that satisfy `collides`. An object that is not yet measured becomes
// a particle and must not be simulated. Throws Error(input) for an object without a signature that
// is missing in Model::signatures, and for a signature with another mesh, scale or material, or
// without packing.
BodySignatures load_signatures(const Model& model,
                               const std::function<bool(const ModelBody&)>& collides);
// The same for all dynamic bodies.
BodySignatures load_signatures(const Model& model);

// For reports: one line per shape with a signature.
std::vector<std::string> describe_signatures(const Model& model, const BodySignatures& objects);

// A body that packs as `packing` says, instead of its signature's packing.
BodySignature body_signature(std::shared_ptr<const Signature> signature, const Packing& packing);

// Spheres of particles, from geometry alone, without signatures.
BodySignatures particle_spheres(const Model& model);

}  // namespace pilesim
