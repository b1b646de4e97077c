// The equilibrium of one body as in the dissertation (2.25 to 2.28, 6.2.1): forces at its contacts
// within friction pyramids that carry its weight and leave no torque, by linear programming. The
// project's own analysis is equilibrium.h.
//
// Solutions are not unique; this one is the vertex that Bland's rule reaches, with normal forces
// before friction. The dissertation uses the one that its solver returns.
#pragma once

#include <span>
#include <vector>

#include "pile/guide/equilibrium.h"

namespace pilesim {

// Tolerance of the balance and of each force, in weights, as is usual for linear programs.
inline constexpr double kForceTolerance = 1e-6;

// The force of one contact, in weights; the tangents are orthogonal and follow from the normal
// alone.
struct PyramidForce {
  double normal = 0;                    // >= 0
  double tangent_1 = 0, tangent_2 = 0;  // each at most friction times `normal`
};

class ForcePyramids {
 public:
  // True if such forces exist. `centre` of mass in m; `radius_m` > 0 is the bounding radius; `up`
  // is unit, against gravity.
  bool solve(const Vec3& centre, double radius_m, std::span<const SupportPoint> contacts,
             const Vec3& up);
  // Forces of the last solution, by contact.
  std::span<const PyramidForce> forces() const { return forces_; }

 private:
  void set_up(const Vec3& centre, double radius_m, std::span<const SupportPoint> contacts,
              const Vec3& up);
  bool is_free(Eigen::Index variable) const;
  Eigen::Index entering();
  Eigen::Index leaving(Eigen::Index entering) const;

  Eigen::Index count_ = 0;  // number of contacts
  // Rows: six of the balance, four per contact for (2.28), the cost. Columns: normal forces, pairs
  // of tangential forces, slack variables of (2.28), and the right-hand side.
  Eigen::MatrixXd tableau_;
  std::vector<Eigen::Index> basis_;  // by row; -1: its residual
  std::vector<double> sign_;         // by variable: free ones may be negated
  std::vector<PyramidForce> forces_;
};

}  // namespace pilesim
