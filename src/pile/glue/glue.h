// The least glue with which a whole pile stands. Contact forces must keep every body in balance,
// each compressive and within its friction cone. Where that is impossible, the least adhesion
// ("glue") makes it possible. Adhesion g shifts a contact's cone: the normal part reaches down to
// -g, and friction allows friction * (normal part + g).
//
//   minimise  sum g + sum |m| / (patch r) + push_cost sum p
//   where for each body the forces (p - g) n + t of its contacts, and the torques m of its pairs,
//   balance its weight;  |t| <= friction p,  g >= 0
//
// Where a pair already has a spot of glue, forces and torques up to its strength cost next to
// nothing, so that new glue is only what the pile lacks.
//
// This is a second-order cone program, solved by a primal-dual interior point method. A pair's
// torque m is that of a patch of glue of some size. It balances bodies with too few contacts, so
// that every body connected to a fixed one can be held. The cost of normal forces keeps
// self-stresses from growing without bound.
//
// Forces are divided by g, thus in kg. Nothing depends on scale, gravity or the unit of mass.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/types.h"

namespace pilesim {

struct GlueBody {
  Vec3 centre;      // of mass, m
  double radius_m;  // > 0, about the centre
  double mass_kg;   // 0: fixed
};

struct GlueContact {
  uint32_t a, b;    // indices of two different bodies
  Vec3 position;    // m
  Vec3 normal;      // unit, from b towards a
  double friction;  // >= 0
};

// A spot of glue that joins two bodies: it transmits any force and torque up to these limits.
struct GlueThere {
  uint32_t a, b;             // each pair at most once
  Vec3 position;             // m
  double most_kg, most_kgm;  // > 0
};

struct GlueSettings {
  double patch = 0.1;  // radius of the glue that carries a torque, relative to the smaller body's
  double push_cost = 1e-4;  // cost of a contact's normal force; glue costs 1
  // Relative tolerance of the total glue, and of balance in the mean weight and the largest force:
  // where a foot carries a thousand weights, rounding alone exceeds 1e-6 of one weight.
  double tolerance = 1e-6;
  int most_iterations = 100;
};

// A patch of glue that keeps a pair of bodies from turning relative to each other.
struct GluePatch {
  uint32_t a, b;  // same order as in the first of the pair's contacts
  Vec3 torque;    // kg m, on a
  double glue_kg;
};

struct GlueSolution {
  bool is_solved = false;          // false: no forces were found; ignore the other fields
  std::vector<Vec3> force;         // (contacts) kg, on a, including glue
  std::vector<double> glue_kg;     // (contacts) >= 0
  std::vector<GluePatch> patches;  // those with a torque
  // (bodies) 1: no chain of contacts and spots connects it to a fixed body. Contacts of such bodies
  // have no forces.
  std::vector<uint8_t> hangs;
  // (there) force and torque on a, kg and kg m, and by how much the force exceeds the strength, kg.
  std::vector<Vec3> there_force, there_torque;
  std::vector<double> there_lacks;
  double total_kg = 0;  // of contacts and patches, plus the shortage of spots
  int iterations = 0;
};

// `up` is unit, against gravity. Deterministic at any number of threads.
GlueSolution least_glue(std::span<const GlueBody> bodies, std::span<const GlueContact> contacts,
                        const Vec3& up, const GlueSettings& settings = {},
                        std::span<const GlueThere> there = {});

// Checks a solution against bodies and contacts alone, in long double.
struct GlueCertificate {
  // The largest residual (force, torque) of a body that does not hang, in m g and m g r.
  double unbalanced = 0;
  double outside = 0;   // largest violation of a cone or a strength, in the mean weight
  double total_kg = 0;  // total glue; < 0: some glue is negative, or too little for a torque
};

GlueCertificate certify(std::span<const GlueBody> bodies, std::span<const GlueContact> contacts,
                        const Vec3& up, const GlueSolution& solution, double patch,
                        std::span<const GlueThere> there = {});

}  // namespace pilesim
