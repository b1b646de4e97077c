#include "simulate/bullet/bullet_plane_collision.h"

#include <algorithm>
#include <array>

#include "simulate/bullet/bullet_constants.h"

namespace pilesim {

using namespace bullet_constants;

namespace {

const ConvexPieces& pieces_of(const btCollisionObject& body) {
  return *static_cast<const ConvexPieces*>(body.getCollisionShape()->getUserPointer());
}

double reach_of(const btCollisionObject& body) {
  const btVector3 half = pieces_of(body).half_extent;
  return std::min<double>(
      body.getCollisionShape()->getContactBreakingThreshold(gContactBreakingThreshold),
      2 * kReachShare * half[half.minAxis()]);
}

}  // namespace

Plane world_plane(const btCollisionObject& body) {
  const auto& shape = static_cast<const btStaticPlaneShape&>(*body.getCollisionShape());
  const btTransform& pose = body.getWorldTransform();
  const btVector3 normal = pose.getBasis() * shape.getPlaneNormal();
  return {normal, shape.getPlaneConstant() + normal.dot(pose.getOrigin())};
}

btManifoldPoint facing_contact(const FacingPoint& point, const Plane& plane,
                               const btCollisionObject& body, const btCollisionObject& other) {
  const btVector3 on_other = point.point - point.height * plane.normal;
  btManifoldPoint contact(body.getWorldTransform().invXform(point.point),
                          other.getWorldTransform().invXform(on_other), plane.normal, point.height);
  contact.m_positionWorldOnA = point.point;
  contact.m_positionWorldOnB = on_other;
  contact.m_combinedFriction = btManifoldResult::calculateCombinedFriction(&body, &other);
  contact.m_combinedRestitution = btManifoldResult::calculateCombinedRestitution(&body, &other);
  contact.m_index0 = point.id;
  return contact;
}

PlaneCollisionAlgorithm::PlaneCollisionAlgorithm(const btCollisionAlgorithmConstructionInfo& info,
                                                 const btCollisionObject& body,
                                                 const btCollisionObject& plane)
    : PairAlgorithm(info), body_(body), plane_(plane), reach_(reach_of(body)) {}

PlaneCollisionAlgorithm::~PlaneCollisionAlgorithm() {
  if (manifold_ != nullptr) m_dispatcher->releaseManifold(manifold_);
}

void PlaneCollisionAlgorithm::save(BulletPair& state) const {
  if (manifold_ != nullptr) state.manifolds = {place_of(manifold_)};
}

void PlaneCollisionAlgorithm::load(const BulletPair& state, ManifoldPlaces& places) {
  StateReader::require(state.manifolds.size() <= 1, "one contact manifold with a plane");
  if (state.manifolds.empty()) return;
  manifold_ = m_dispatcher->getNewManifold(&body_, &plane_);
  places.put(state.manifolds.front(), *manifold_);
}

void PlaneCollisionAlgorithm::getAllContactManifolds(btManifoldArray& manifolds) {
  if (manifold_ != nullptr) manifolds.push_back(manifold_);
}

void PlaneCollisionAlgorithm::processCollision(const btCollisionObjectWrapper* /*a*/,
                                               const btCollisionObjectWrapper* /*b*/,
                                               const btDispatcherInfo& /*info*/,
                                               btManifoldResult* /*result*/) {
  const Plane plane = world_plane(plane_);
  collect_points(plane);
  if (manifold_ == nullptr && !points_.empty()) {
    manifold_ = m_dispatcher->getNewManifold(&body_, &plane_);
  }
  if (manifold_ != nullptr) write_contacts(plane);
}

void PlaneCollisionAlgorithm::collect_points(const Plane& plane) {
  points_.clear();
  const btTransform& pose = body_.getWorldTransform();
  const btVector3 local_normal = plane.normal * pose.getBasis();
  const std::vector<ConvexPiece>& pieces = pieces_of(body_).pieces;
  for (size_t i = 0; i < pieces.size(); ++i) {
    const double lowest =
        plane.height(pose * pieces[i].centre) - local_normal.absolute().dot(pieces[i].half_extent);
    if (lowest > reach_) continue;
    append_facing_points(pieces[i], pose, plane, reach_, static_cast<int>(i) * kFacingIds, points_);
  }
  for (int i = 0; manifold_ != nullptr && i < manifold_->getNumContacts(); ++i) {
    const auto contact =
        std::ranges::find(points_, manifold_->getContactPoint(i).m_index0, &FacingPoint::id);
    if (contact != points_.end()) contact->favour_m = kFavour * reach_;
  }
  keep_widest_four(plane, kPreferLow, points_);
}

void PlaneCollisionAlgorithm::write_contacts(const Plane& plane) {
  std::array<btManifoldPoint, MANIFOLD_CACHE_SIZE> former;
  const int former_count = manifold_->getNumContacts();
  for (int i = 0; i < former_count; ++i) {
    former[static_cast<size_t>(i)] = manifold_->getContactPoint(i);
  }
  manifold_->clearManifold();
  for (const FacingPoint& point : points_) {
    btManifoldPoint contact = facing_contact(point, plane, body_, plane_);
    for (int i = 0; i < former_count; ++i) {
      const btManifoldPoint& before = former[static_cast<size_t>(i)];
      if (before.m_index0 != point.id) continue;
      contact.m_appliedImpulse = before.m_appliedImpulse;
      contact.m_prevRHS = before.m_prevRHS;
      contact.m_appliedImpulseLateral1 = before.m_appliedImpulseLateral1;
      contact.m_appliedImpulseLateral2 = before.m_appliedImpulseLateral2;
      contact.m_lateralFrictionDir1 = before.m_lateralFrictionDir1;
      contact.m_lateralFrictionDir2 = before.m_lateralFrictionDir2;
    }
    manifold_->addManifoldPoint(contact);
  }
}

}  // namespace pilesim
