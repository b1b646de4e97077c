#include "simulate/bullet/bullet_closest_points.h"

namespace pilesim {

namespace {

struct Receiver final : btDiscreteCollisionDetectorInterface::Result {
  void setShapeIdentifiersA(int, int) override {}
  void setShapeIdentifiersB(int, int) override {}
  void addContactPoint(const btVector3& normal, const btVector3& point, btScalar gap) override {
    found = {normal, point, gap};
  }
  std::optional<ClosestPoints> found;
};

}  // namespace

double skin_m(const btConvexShape& shape) {
  return shape.getShapeType() == CUSTOM_CONVEX_SHAPE_TYPE ? shape.getMarginNonVirtual() : 0;
}

std::optional<ClosestPoints> closest_points(const btConvexShape& a, const btTransform& pose_a,
                                            const btConvexShape& b, const btTransform& pose_b,
                                            double reach_m,
                                            btConvexPenetrationDepthSolver* depth_solver,
                                            btVector3* apart) {
  btGjkPairDetector::ClosestPointInput input;
  input.m_transformA = pose_a;
  input.m_transformB = pose_b;
  const double reach = reach_m + a.getMarginNonVirtual() + b.getMarginNonVirtual();
  input.m_maximumDistanceSquared = reach * reach;
  btVoronoiSimplexSolver simplex;
  btGjkPairDetector detector(&a, &b, &simplex, depth_solver);
  Receiver receiver;
  detector.getClosestPoints(input, receiver, nullptr);
  if (apart != nullptr) *apart = detector.getCachedSeparatingAxis();
  if (!receiver.found) return std::nullopt;
  ClosestPoints found = *receiver.found;
  found.distance += skin_m(a) + skin_m(b);
  found.point_on_b -= skin_m(b) * found.normal_on_b;
  if (found.distance > reach_m) return std::nullopt;
  return found;
}

}  // namespace pilesim
