// Which algorithm finds the contacts of a pair of shapes.
#pragma once

#include "simulate/bullet/bullet_piece_collision.h"
#include "simulate/bullet/bullet_plane_collision.h"

namespace pilesim {

// Stock Bullet's choice, but for planes and for bodies of hulls or of several pieces.
class BulletCollisionConfiguration final : public btDefaultCollisionConfiguration {
 public:
  BulletCollisionConfiguration();
  btCollisionAlgorithmCreateFunc* getCollisionAlgorithmCreateFunc(int type_a, int type_b) override;

 private:
  struct CreatePieces final : btCollisionAlgorithmCreateFunc {
    explicit CreatePieces(btConvexPenetrationDepthSolver& solver) : depth_solver(solver) {}
    btCollisionAlgorithm* CreateCollisionAlgorithm(btCollisionAlgorithmConstructionInfo& info,
                                                   const btCollisionObjectWrapper* a,
                                                   const btCollisionObjectWrapper* b) override;
    btConvexPenetrationDepthSolver& depth_solver;
  };
  struct CreatePlane final : btCollisionAlgorithmCreateFunc {
    explicit CreatePlane(bool plane_first) { m_swapped = plane_first; }
    btCollisionAlgorithm* CreateCollisionAlgorithm(btCollisionAlgorithmConstructionInfo& info,
                                                   const btCollisionObjectWrapper* a,
                                                   const btCollisionObjectWrapper* b) override;
  };

  CreatePieces pieces_{*m_pdSolver};
  CreatePlane body_with_plane_{false};
  CreatePlane plane_with_body_{true};
};

}  // namespace pilesim
