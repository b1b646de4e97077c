// A model's bodies and settings in the sphere engine: constant during steps.
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "model/model.h"
#include "simulate/sphere/body_ellipsoid.h"
#include "simulate/sphere/body_signature.h"
#include "simulate/sphere/convex_extent.h"
#include "simulate/sphere/dispatch_table.h"
#include "simulate/sphere/face_patch.h"
#include "simulate/sphere/sphere_constants.h"
#include "simulate/sphere/sphere_state.h"

namespace pilesim {

struct SphereWorldSettings {
  Vec3f gravity;  // m/s^2
  float step_s;
  uint64_t seed;
  bool sleeping;
  bool rest_control;
  int sweeps;  // of the contact solver
  // The method for pairs if `dispatch` is null.
  PairMethod method = PairMethod::statistical;
  const DispatchTable* dispatch = nullptr;  // must outlive the world
  bool blocks = false;  // bodies that start asleep and fill their box touch each other by faces
};

// Bodies of one shape, material and mass.
struct SphereKind {
  const BodySignature* object = nullptr;  // null if not dynamic
  float mass_kg = 0;
  float radius_m = 0;       // among bodies, except in a structure
  float outer_m = 0;        // of the body
  float thin_m = 0;         // no surface outside the body is nearer to its centre
  EllipsoidForm form;       // among bodies, unless it started in a structure
  bool is_round = true;     // the form is a ball
  float rolling_m = 0;      // see SphereContact
  float control_speed = 0;  // m/s; slower bodies turn to a pose
  float root_friction = 0;  // includes interlocking
  float root_restitution = 0;
  float lift = 0;                               // see SphereContact
  float inverse_mass = 0, inverse_inertia = 0;  // 1/kg, 1/(kg m^2)
  std::optional<BlockShape> block;              // if structures consist of blocks
  ConvexExtent hull;                            // of bodies with a signature
};

struct SphereModel {
  // All arguments must outlive it.
  SphereModel(const Model& model, const BodySignatures& objects,
              const SphereWorldSettings& settings);

  const SphereKind& kind(uint32_t body) const { return kinds[kind_of[body]]; }
  PairMethod method(uint32_t body, uint32_t other) const {
    return settings.dispatch == nullptr ? settings.method : settings.dispatch->method(body, other);
  }
  // Distance from its centre within which a body with this radius among others may be touched.
  float reach_m(uint32_t body, bool is_block, float radius_m) const {
    const SphereKind& kind = this->kind(body);
    const float outer = is_stretched(body) ? kind.form.longest * radius_m * unlike : radius_m;
    return (is_block ? kind.outer_m : outer) * (1 + sphere_constants::kNearby);
  }
  // A body that starts in a structure stays a ball: it fits by its radius.
  bool is_stretched(uint32_t body) const { return stretched[body] != 0; }
  BodyEllipsoid ellipsoid(uint32_t body, const Quatf& orientation, float radius_m) const {
    return is_stretched(body) ? kind(body).form.placed(orientation, radius_m)
                              : BodyEllipsoid::ball(radius_m);
  }
  // m/s; slower bodies may sleep
  float rest_speed(const SphereKind& kind) const {
    return sphere_constants::kRestSpeed * std::sqrt(settings.gravity.norm() * kind.outer_m);
  }
  // True if a body touches this surface with its hull instead of its resting radius. False for
  // bodies in a structure, where `radius_m` is that of the sphere, and for bodies that another
  // engine moves as well.
  bool has_extent(uint32_t body, const SphereBody& state, float radius_m, uint32_t surface) const {
    return !state.shared && !kind(body).hull.is_empty() && radius_m == kind(body).radius_m &&
           method(body, surface) == PairMethod::statistical;
  }
  // m/s; faster approaches are collisions
  float impact_speed(float radius_m) const {
    return impact_base + impact_rise * std::sqrt(radius_m);
  }

  const Model& model;
  SphereWorldSettings settings;
  std::vector<SphereKind> kinds;
  std::vector<uint32_t> kind_of;   // (B)
  std::vector<uint8_t> stretched;  // (B) bodies that are no balls among others
  // Bodies with different ellipsoids may touch beyond their longest semi-axes, at most by this
  // factor.
  float unlike = 1;
  Vec3f up = Vec3f::UnitY();    // against gravity
  bool has_structures = false;  // some bodies start asleep: bodies on a moving one move with it
  float impact_base = 0, impact_rise = 0;  // m/s, sqrt(m)/s: see impact_speed()
};

}  // namespace pilesim
