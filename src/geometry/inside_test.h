// Point-in-mesh test that holds on dirty meshes: the generalized winding number (Jacobson et al.
// 2013), summed over a tree with dipole far fields (Barill et al. 2018). It degrades gracefully at
// holes, overlaps and stray triangles, where ray casting fails at random.
#pragma once

#include <memory>

#include "core/types.h"
#include "geometry/mesh.h"

namespace pilesim {

class InsideTest {
 public:
  explicit InsideTest(const TriangleMesh& mesh);
  ~InsideTest();
  InsideTest(InsideTest&&) noexcept;
  InsideTest& operator=(InsideTest&&) noexcept;

  // About 1 inside, 0 outside, in between near holes. Within 1e-3 of the exact sum.
  double winding_number(const Vec3& point) const;
  bool contains(const Vec3& point) const { return winding_number(point) > 0.5; }

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

}  // namespace pilesim
