// Can a body stand on its contacts? (Dissertation 6.2.1.) Contact forces within their friction
// cones are sought that carry the weight and leave no torque: the point of the cone of all wrenches
// that the contacts can give that is nearest to the wrench wanted. It is found by non-negative
// least squares over edges of the friction cones (Lawson and Hanson), of which the six rows keep at
// most six: each sweep takes in the edge that the unbalanced rest pushes on most. The edges of an
// exact cone are never listed; the one that matters follows from the relative motion of the
// contact.
//
// Forces are in weights m g, torques in m g r with the body's bounding radius r, so that nothing
// depends on units, size, mass or gravity.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/types.h"

namespace pilesim {

struct SupportPoint {
  Vec3 position;    // m, world frame
  Vec3 normal;      // unit, towards the body that is analysed
  double friction;  // Coulomb, >= 0
};

struct ContactForce {
  uint32_t contact;  // index into the contacts given
  Vec3 force;        // in weights, world frame, onto the body
};

// With its certificate: stable bodies have forces that balance within the tolerance, others a
// motion that gravity drives and no contact resists.
struct EquilibriumVerdict {
  bool stable = false;
  // Where the contacts come nearest to balance: the size of the (force, torque) left over, in
  // weights; with torques over m g r it is an acceleration in g.
  double unbalanced = 0;
  Vec3 push = Vec3::Zero();  // the force left over: the direction of the first motion
  Vec3 turn = Vec3::Zero();  // the torque left over
  // The most power, for a motion (push, turn) / unbalanced, of a contact force with normal part 1:
  // above rounding only if the iteration stopped early. For bodies that are not stable.
  double resistance = 0;
  int sweeps = 0;
};

// Holds one body at a time; keeps its memory from one to the next.
class EquilibriumSolver {
 public:
  // `tolerance`, > 0: an unbalanced rest that counts as none, in weights.
  explicit EquilibriumSolver(double tolerance = 1e-3) : tolerance_(tolerance) {}

  // `centre` of mass in m; `radius_m` > 0 bounds the body about it.
  void set_body(const Vec3& centre, double radius_m, std::span<const SupportPoint> contacts);
  void scale_friction(double factor);  // of every contact as it was given, >= 0

  // `up` is unit, against gravity.
  EquilibriumVerdict solve(const Vec3& up = Vec3::UnitY());
  // Forces of the last verdict; at most six contacts carry.
  std::span<const ContactForce> forces() const { return forces_; }

  uint32_t contact_count() const { return count_; }

 private:
  using Wrench = Eigen::Matrix<double, 6, 1>;  // force in weights, torque in m g r
  struct Edge {
    uint32_t contact = 0;
    double power = 0;
    Vec3 force;  // normal part 1
  };
  // Edges in use with their QR factors.
  struct ActiveSet {
    int count = 0;
    std::array<Wrench, 6> column, q;
    std::array<std::array<double, 6>, 6> r;  // r[row][column], upper
    std::array<double, 6> projection;        // of the wanted wrench on q
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
  // (C padded to 4) contacts, one array a component: normals, arms over r, friction. Padding has
  // zero normals and no friction.
  std::array<std::vector<double>, 3> normal_, arm_;
  std::vector<double> friction_, given_friction_, power_;
  ActiveSet active_;
  std::vector<ContactForce> forces_;
};

// Twice the area of the largest triangle over the two contacts farthest apart, in r^2: 0 where all
// lie in a line. A bound on it does what (6.2) is meant to do without depending on scale, on the
// order of the contacts or on two of them that coincide.
double contact_spread(std::span<const SupportPoint> contacts, double radius_m);

}  // namespace pilesim
