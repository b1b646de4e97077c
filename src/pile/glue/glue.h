// The least glue with which a whole pile stands: forces at its contacts that keep every body in
// balance, each within its friction cone and pushing only, and where that cannot be, the least
// adhesion ("glue") with which it can. Adhesion g at a contact shifts its cone: a normal part down
// to -g, and friction of (normal part + g).
//
//   minimise  sum g + sum |m| / (patch r) + push_cost sum p
//   where for each body the forces (p - g) n + t of its contacts, and the torques m of its pairs,
//   balance its weight;  |t| <= friction p,  g >= 0
//
// Where pairs have a spot of glue already, the force and the torque that it has the strength for
// cost next to nothing: further glue is what the pile lacks.
//
// A second-order cone program, solved by a primal-dual interior point method. A pair's torque m is
// that of a patch of glue of some size: contacts too few for balance hold with it, so that whatever
// hangs together with something fixed can be held. The cost of pushing keeps stresses that cost
// nothing from growing without bound.
//
// Forces are over g, thus in kg. Nothing depends on scale, gravity or the unit of mass.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/types.h"

namespace pilesim {

struct GlueBody {
  Vec3 centre;      // of mass, m
  double radius_m;  // > 0, about the centre
  double mass_kg;   // 0: stands by itself
};

struct GlueContact {
  uint32_t a, b;    // indices of bodies, not the same
  Vec3 position;    // m
  Vec3 normal;      // unit, from b towards a
  double friction;  // >= 0
};

// A spot of glue that two bodies have: it gives any force and any torque, up to these.
struct GlueThere {
  uint32_t a, b;             // each pair once
  Vec3 position;             // m
  double most_kg, most_kgm;  // > 0
};

struct GlueSettings {
  double patch = 0.1;       // radius of the glue that carries a torque, in the smaller body's
  double push_cost = 1e-4;  // of a contact's push, where glue costs 1
  // Tolerance of the glue in all, relative; of balance, in the mean weight and the largest force:
  // where a foot carries a thousand weights rounding alone leaves more than 1e-6 of one.
  double tolerance = 1e-6;
  int most_iterations = 100;
};

// A patch of glue that keeps a pair of bodies from turning.
struct GluePatch {
  uint32_t a, b;  // as in the first of the pair's contacts
  Vec3 torque;    // kg m, onto a
  double glue_kg;
};

struct GlueSolution {
  bool is_solved = false;          // false: no forces were found; what follows is not to be used
  std::vector<Vec3> force;         // (contacts) kg, onto a, glue included
  std::vector<double> glue_kg;     // (contacts) >= 0
  std::vector<GluePatch> patches;  // those that carry
  // (bodies) 1: no chain of contacts and spots leads to something that stands by itself. Their
  // contacts have no forces.
  std::vector<uint8_t> hangs;
  // (there) what they give to a, kg and kg m; of the force, how much more than they can, kg.
  std::vector<Vec3> there_force, there_torque;
  std::vector<double> there_lacks;
  double total_kg = 0;  // of contacts and patches, and what spots lack
  int iterations = 0;
};

// `up` is unit, against gravity. Deterministic at any number of threads.
GlueSolution least_glue(std::span<const GlueBody> bodies, std::span<const GlueContact> contacts,
                        const Vec3& up, const GlueSettings& settings = {},
                        std::span<const GlueThere> there = {});

// A solution judged from bodies and contacts alone, in long double.
struct GlueCertificate {
  // The most of any body that does not hang: (force, torque) left over in its m g and m g r.
  double unbalanced = 0;
  double outside =
      0;  // the most by which a force leaves its cone or its strength, in the mean weight
  double total_kg =
      0;  // the sum of the glue; < 0: some glue is negative, or a torque has too little
};

GlueCertificate certify(std::span<const GlueBody> bodies, std::span<const GlueContact> contacts,
                        const Vec3& up, const GlueSolution& solution, double patch,
                        std::span<const GlueThere> there = {});

}  // namespace pilesim
