// Generalised winding numbers of many points: what is far away counts as dipoles (Barill et al.
// 2018), good to some hundredths. Where it matters whether a point is inside, InsideTest decides.
#pragma once

#include <vector>

#include "geometry/inside_test.h"
#include "geometry/triangle_tree.h"

namespace pilesim {

class FastWinding {
 public:
  explicit FastWinding(const TriangleMesh& mesh);

  const TriangleTree& triangles() const { return tree_; }
  bool contains(const Vec3& point) const;

 private:
  double approximate(const Vec3& point) const;

  struct Dipole {
    Vec3 centre;  // of area
    Vec3 normal;  // summed, times area, m^2
    double radius;
  };
  TriangleTree tree_;
  InsideTest exact_;
  std::vector<Dipole> dipoles_;  // per node
};

}  // namespace pilesim
