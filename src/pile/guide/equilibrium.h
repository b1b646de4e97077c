// Can a body stand on its contacts? (Dissertation 6.2.1.) The solver looks for contact forces
// within their friction cones that carry the weight and leave no torque. It computes the point of
// the cone of all possible wrenches that is nearest to the required one, by non-negative least
// squares over edges of the friction cones (Lawson and Hanson). Six rows keep at most six edges
// active. Each iteration adds the edge on which the residual does most work; for an exact cone this
// edge follows from the contact's relative motion, so edges are never listed.
//
// Forces are in weights m g, torques in m g r with the body's bounding radius r, so nothing depends
// on units, size, mass or gravity.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/types.h"

namespace pilesim {

struct SupportPoint {
  Vec3 position;    // m, world frame
  Vec3 normal;      // unit, towards the analysed body
  double friction;  // Coulomb, >= 0
};

struct ContactForce {
  uint32_t contact;  // index into the given contacts
  Vec3 force;        // in weights, world frame, on the body
};

// A verdict with its certificate: forces that balance within the tolerance if stable, else a motion
// that gravity drives and no contact resists.
struct EquilibriumVerdict {
  bool stable = false;
  // Size of the smallest residual (force, torque), in weights and m g r, which equals an
  // acceleration in g.
  double unbalanced = 0;
  Vec3 push = Vec3::Zero();  // residual force: the direction of the first motion
  Vec3 turn = Vec3::Zero();  // residual torque
  // Largest power of a contact force with normal part 1 during the motion (push, turn) /
  // unbalanced. It exceeds rounding only if the iteration stopped early. Only for unstable bodies.
  double resistance = 0;
  int sweeps = 0;
};

// Solves one body at a time and reuses its memory.
class EquilibriumSolver {
 public:
  // `tolerance`, > 0: residual that counts as balanced, in weights.
  explicit EquilibriumSolver(double tolerance = 1e-3) : tolerance_(tolerance) {}

  // `centre` of mass in m; `radius_m` > 0 is the bounding radius about it.
  void set_body(const Vec3& centre, double radius_m, std::span<const SupportPoint> contacts);
  void scale_friction(double factor);  // factor on every contact's given friction, >= 0

  // `up` is unit, against gravity.
  EquilibriumVerdict solve(const Vec3& up = Vec3::UnitY());
  // Forces of the last verdict; at most six contacts carry load.
  std::span<const ContactForce> forces() const { return forces_; }

  uint32_t contact_count() const { return count_; }

 private:
  using Wrench = Eigen::Matrix<double, 6, 1>;  // force in weights, torque in m g r
  struct Edge {
    uint32_t contact = 0;
    double power = 0;
    Vec3 force;  // with normal part 1
  };
  // Active edges with their QR factors.
  struct ActiveSet {
    int count = 0;
    std::array<Wrench, 6> column, q;
    std::array<std::array<double, 6>, 6> r;  // r[row][column], upper
    std::array<double, 6> projection;        // of the required wrench on q
    std::array<double, 6> weight;            // >= 0, of each edge
    std::array<Edge, 6> edge;
  };

  Edge steepest_edge(const Wrench& left);
  Vec3 edge_force(uint32_t contact, const Vec3& motion) const;
  Wrench wrench_of(const Edge& edge) const;
  bool factor_column(int k);
  void take_in(const Wrench& wanted, Wrench& left);
  void gather_forces();
  void power_of_cones(const Wrench& left);

  double tolerance_;
  uint32_t count_ = 0;
  // (C padded to 4) contacts, one array per component: normals, arms over r, friction. Padding has
  // zero normals and no friction.
  std::array<std::vector<double>, 3> normal_, arm_;
  std::vector<double> friction_, given_friction_, power_;
  ActiveSet active_;
  std::vector<ContactForce> forces_;
};

// Twice the area of the largest triangle over the two most distant contacts, in r^2; 0 where all
// are collinear. A bound on it serves the purpose of (6.2), but does not depend on scale, on the
// order of contacts or on coincident ones.
double contact_spread(std::span<const SupportPoint> contacts, double radius_m);

}  // namespace pilesim
