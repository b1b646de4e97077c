// Point-in-mesh test that holds on dirty meshes: the generalized winding number (Jacobson et al.
// 2013). It degrades gracefully at holes, overlaps and stray triangles, where ray casting fails at
// random. Summed over a tree: a cluster of triangles seen from outside its box has the winding
// number of any cap over its border, which has far fewer triangles. That is exact; a dipole far
// field (Barill et al. 2018) errs by 0.05 in the middle of a sphere, where all clusters are as far.
#pragma once

#include <memory>

#include "core/types.h"
#include "geometry/mesh.h"

namespace pilesim {

class InsideTest {
 public:
  // `mesh` has triangles; it is copied as far as needed.
  explicit InsideTest(const TriangleMesh& mesh);
  ~InsideTest();
  InsideTest(InsideTest&&) noexcept;
  InsideTest& operator=(InsideTest&&) noexcept;

  // 1 inside, 0 outside, in between near holes, 2 inside two shells. Exact up to rounding.
  double winding_number(const Vec3& point) const;
  bool contains(const Vec3& point) const { return winding_number(point) > 0.5; }

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

}  // namespace pilesim
