// Contacts between a body made of convex pieces and a plane.
#pragma once

#include <vector>

#include "simulate/bullet/bullet_algorithms.h"
#include "simulate/bullet/bullet_facing_points.h"

namespace pilesim {

// In each step all points of the body that face the plane are looked at and the four that carry it
// best are its contacts; a point that was one in the step before keeps its impulses. Stock Bullet
// collects points over several steps: of thin rods it merges them, and those of a rolling cylinder
// stay behind and drive it.
class PlaneCollisionAlgorithm final : public PairAlgorithm {
 public:
  PlaneCollisionAlgorithm(const btCollisionAlgorithmConstructionInfo& info,
                          const btCollisionObject& body, const btCollisionObject& plane);
  ~PlaneCollisionAlgorithm() override;

  void processCollision(const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b,
                        const btDispatcherInfo& info, btManifoldResult* result) override;
  void getAllContactManifolds(btManifoldArray& manifolds) override;

  BulletAlgorithm kind() const override { return BulletAlgorithm::plane; }
  void save(BulletPair& state) const override;
  void load(const BulletPair& state, ManifoldPlaces& places) override;

 private:
  void collect_points(const Plane& plane);
  void write_contacts(const Plane& plane);

  const btCollisionObject& body_;
  const btCollisionObject& plane_;
  double reach_;  // m: points that are higher are no contacts
  btPersistentManifold* manifold_ = nullptr;
  std::vector<FacingPoint> points_;  // scratch
};

// The plane of a body with a btStaticPlaneShape, world.
Plane world_plane(const btCollisionObject& body);

// A contact of `body` with `other` at a point of `body`; the plane is that of `other`'s surface.
btManifoldPoint facing_contact(const FacingPoint& point, const Plane& plane,
                               const btCollisionObject& body, const btCollisionObject& other);

}  // namespace pilesim
