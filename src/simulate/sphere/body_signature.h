// An object as the engine of spheres knows it: its signature and what follows from it.
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
  std::optional<ResponseModel> responses;      // of the signature: tables or splines
  float gyration_m = 0;
  float outer_radius_m = 0;
  // Where the moments differ and responses are by energy (SpinMeasure): body frame, k^-1 I^(1/2)
  // and its inverse.
  std::optional<Eigen::Matrix3f> to_spin, to_angular_velocity;
  // Radius of the sphere that stands for the body among others: such spheres pile up as high as the
  // bodies do.
  float packing_radius_m = 0;
  // Resistance to rolling, in radii: a ball rolls for ever, a block does not.
  float rolling = 0;
  // How far impacts turn a body on others to a rest pose, and the rate, sqrt(g / outer radius), at
  // which a body that leans on a wall turns to lie against it (Packing).
  float turning = 0, leaning = 0;
  float rebound = 1;  // share of a drawn rebound from a surface that is left
  // Bodies that are no balls catch on each other: how much more their spheres rub there.
  float interlocking = 1;
  std::vector<RestTarget> rest_targets;

  // Between an angular velocity, rad/s, and what responses mean by a spin, world frame.
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

// The objects of dynamic bodies for which `collides` holds, and whose shapes name no signature: to
// be put into Model::signatures.
std::vector<ObjectKey> objects_to_measure(const Model& model,
                                          const std::function<bool(const ModelBody&)>& collides);

// Those of dynamic bodies for which `collides` holds, and nothing for the other ones. An object
// that is not measured yet is a particle, until when nothing may be simulated. Throws Error(input)
// for an object without signature that is not in Model::signatures, for a signature of another
// mesh, another scale or another material, and for one that does not say how its object packs.
BodySignatures load_signatures(const Model& model,
                               const std::function<bool(const ModelBody&)>& collides);
// The same for all dynamic bodies.
BodySignatures load_signatures(const Model& model);

// For reports: a line a shape that collides by its signature.
std::vector<std::string> describe_signatures(const Model& model, const BodySignatures& objects);

// For a body that packs as `packing` says, in place of its signature's packing.
BodySignature body_signature(std::shared_ptr<const Signature> signature, const Packing& packing);

// The spheres of particles, by geometry alone, without signatures.
BodySignatures particle_spheres(const Model& model);

}  // namespace pilesim
