#include "simulate/bullet/bullet_collision_configuration.h"

#include <new>

namespace pilesim {

namespace {

btDefaultCollisionConstructionInfo room_for_own_algorithms() {
  btDefaultCollisionConstructionInfo info;
  info.m_customCollisionAlgorithmMaxElementSize =
      std::max<int>(sizeof(PieceCollisionAlgorithm), sizeof(PlaneCollisionAlgorithm));
  return info;
}

}  // namespace

BulletCollisionConfiguration::BulletCollisionConfiguration()
    : btDefaultCollisionConfiguration(room_for_own_algorithms()) {
  // What is left to stock Bullet, triangles above all, gets several contact points in a step: with
  // one, what hits a wall fast spins instead of stopping.
  setConvexConvexMultipointIterations(3, MANIFOLD_CACHE_SIZE);
}

btCollisionAlgorithm* BulletCollisionConfiguration::CreatePieces::CreateCollisionAlgorithm(
    btCollisionAlgorithmConstructionInfo& info, const btCollisionObjectWrapper* a,
    const btCollisionObjectWrapper* b) {
  void* place = info.m_dispatcher1->allocateCollisionAlgorithm(sizeof(PieceCollisionAlgorithm));
  return new (place) PieceCollisionAlgorithm(info, *a->getCollisionObject(),
                                             *b->getCollisionObject(), depth_solver);
}

btCollisionAlgorithm* BulletCollisionConfiguration::CreatePlane::CreateCollisionAlgorithm(
    btCollisionAlgorithmConstructionInfo& info, const btCollisionObjectWrapper* a,
    const btCollisionObjectWrapper* b) {
  void* place = info.m_dispatcher1->allocateCollisionAlgorithm(sizeof(PlaneCollisionAlgorithm));
  if (m_swapped) std::swap(a, b);
  return new (place)
      PlaneCollisionAlgorithm(info, *a->getCollisionObject(), *b->getCollisionObject());
}

btCollisionAlgorithmCreateFunc* BulletCollisionConfiguration::getCollisionAlgorithmCreateFunc(
    int type_a, int type_b) {
  const auto has_pieces = [](int type) {
    return type == COMPOUND_SHAPE_PROXYTYPE ||
           (btBroadphaseProxy::isConvex(type) && type != TRIANGLE_SHAPE_PROXYTYPE);
  };
  // Boxes and spheres among themselves have better algorithms of their own.
  const auto is_general = [](int type) {
    return type == COMPOUND_SHAPE_PROXYTYPE || type == CUSTOM_CONVEX_SHAPE_TYPE ||
           type == CYLINDER_SHAPE_PROXYTYPE;
  };
  if (has_pieces(type_a) && type_b == STATIC_PLANE_PROXYTYPE) return &body_with_plane_;
  if (type_a == STATIC_PLANE_PROXYTYPE && has_pieces(type_b)) return &plane_with_body_;
  if (has_pieces(type_a) && has_pieces(type_b) && (is_general(type_a) || is_general(type_b))) {
    return &pieces_;
  }
  return btDefaultCollisionConfiguration::getCollisionAlgorithmCreateFunc(type_a, type_b);
}

}  // namespace pilesim
