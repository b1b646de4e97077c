#include "simulate/bullet/bullet_piece_collision.h"

#include <algorithm>
#include <cmath>

#include "simulate/bullet/bullet_closest_points.h"
#include "simulate/bullet/bullet_constants.h"

namespace pilesim {

using namespace bullet_constants;

namespace {

const ConvexPieces& pieces_of(const btCollisionObject& body) {
  return *static_cast<const ConvexPieces*>(body.getCollisionShape()->getUserPointer());
}

bool boxes_meet(const btVector3& centre_a, const btVector3& half_a, const btVector3& centre_b,
                const btVector3& half_b) {
  const btVector3 gap = (centre_a - centre_b).absolute() - half_a - half_b;
  return gap.x() <= 0 && gap.y() <= 0 && gap.z() <= 0;
}

btVector3 turned_extent(const btMatrix3x3& absolute, const btVector3& half) {
  return {absolute[0].dot(half), absolute[1].dot(half), absolute[2].dot(half)};
}

}  // namespace

double resting_gap_m(const ConvexPieces& body_a, const ConvexPiece& a, const ConvexPieces& body_b,
                     const ConvexPiece& b) {
  return std::min({skin_m(*a.shape) + skin_m(*b.shape), body_a.most_gap_m, body_b.most_gap_m});
}

PieceCollisionAlgorithm::PieceCollisionAlgorithm(const btCollisionAlgorithmConstructionInfo& info,
                                                 const btCollisionObject& a,
                                                 const btCollisionObject& b,
                                                 btConvexPenetrationDepthSolver& depth_solver)
    : PairAlgorithm(info),
      a_(pieces_of(a)),
      b_(pieces_of(b)),
      body_a_(a),
      body_b_(b),
      depth_solver_(depth_solver),
      // As the dispatcher gives the manifolds.
      reach_(
          std::min(a.getCollisionShape()->getContactBreakingThreshold(gContactBreakingThreshold),
                   b.getCollisionShape()->getContactBreakingThreshold(gContactBreakingThreshold))),
      radius_a_((a_.centre.absolute() + a_.half_extent).length()),
      b_from_a_(b.getWorldTransform().inverseTimes(a.getWorldTransform())) {}

PieceCollisionAlgorithm::~PieceCollisionAlgorithm() {
  for (PiecePair& pair : pairs_) release(pair);
}

void PieceCollisionAlgorithm::release(PiecePair& pair) {
  if (pair.manifold != nullptr) m_dispatcher->releaseManifold(pair.manifold);
  pair.manifold = nullptr;
}

void PieceCollisionAlgorithm::save(BulletPair& state) const {
  state.b_from_a = from_bullet(b_from_a_);
  state.list_slack_m = list_slack_m_;
  for (const PiecePair& pair : pairs_) {
    state.pieces.push_back({.a = pair.a,
                            .b = pair.b,
                            .apart = from_bullet(pair.apart),
                            .slack_m = pair.slack_m,
                            .manifold = place_of(pair.manifold)});
  }
}

void PieceCollisionAlgorithm::load(const BulletPair& state, ManifoldPlaces& places) {
  b_from_a_ = to_bullet(state.b_from_a);
  list_slack_m_ = state.list_slack_m;
  for (const BulletPiecePair& pair : state.pieces) {
    StateReader::require(pair.a < a_.pieces.size() && pair.b < b_.pieces.size(),
                         "a pair of pieces");
    pairs_.push_back({pair.a, pair.b, to_bullet(pair.apart), pair.slack_m, nullptr});
    if (pair.manifold == kNoManifold) continue;
    pairs_.back().manifold = m_dispatcher->getNewManifold(&body_a_, &body_b_);
    places.put(pair.manifold, *pairs_.back().manifold);
  }
}

void PieceCollisionAlgorithm::getAllContactManifolds(btManifoldArray& manifolds) {
  for (const PiecePair& pair : pairs_) {
    if (pair.manifold != nullptr) manifolds.push_back(pair.manifold);
  }
}

void PieceCollisionAlgorithm::processCollision(const btCollisionObjectWrapper* a,
                                               const btCollisionObjectWrapper* b,
                                               const btDispatcherInfo& /*info*/,
                                               btManifoldResult* result) {
  const btTransform& pose_a = a->getWorldTransform();
  const btTransform& pose_b = b->getWorldTransform();
  const btTransform b_from_a = pose_b.inverseTimes(pose_a);
  const double motion = motion_since_last_step(b_from_a);
  list_slack_m_ -= motion;
  if (list_slack_m_ < 0) list_pairs(b_from_a);
  for (PiecePair& pair : pairs_) {
    pair.slack_m -= motion;
    if (pair.slack_m <= 0) collide(pair, pose_a, pose_b, *result);
  }
}

// No point of body a has moved farther in the frame of body b.
double PieceCollisionAlgorithm::motion_since_last_step(const btTransform& b_from_a) {
  double turn = 0;  // squared, at least as large as by the spectral norm
  for (int i = 0; i < 3; ++i) turn += (b_from_a.getBasis()[i] - b_from_a_.getBasis()[i]).length2();
  const double motion =
      (b_from_a.getOrigin() - b_from_a_.getOrigin()).length() + std::sqrt(turn) * radius_a_;
  b_from_a_ = b_from_a;
  return motion;
}

// Pairs whose boxes nearly meet in the frame of b. Those of the step before keep what they know.
void PieceCollisionAlgorithm::list_pairs(const btTransform& b_from_a) {
  std::swap(pairs_, former_);
  pairs_.clear();
  auto former = former_.begin();
  const btMatrix3x3 absolute = b_from_a.getBasis().absolute();
  list_slack_m_ = kListedReaches * reach_;
  const double distance = reach_ + list_slack_m_;
  const btVector3 skin(distance, distance, distance);
  for (uint32_t i = 0; i < a_.pieces.size(); ++i) {
    const btVector3 centre = b_from_a * a_.pieces[i].centre;
    const btVector3 half = turned_extent(absolute, a_.pieces[i].half_extent) + skin;
    if (!boxes_meet(centre, half, b_.centre, b_.half_extent)) continue;
    for (uint32_t j = 0; j < b_.pieces.size(); ++j) {
      if (!boxes_meet(centre, half, b_.pieces[j].centre, b_.pieces[j].half_extent)) continue;
      while (former != former_.end() && (former->a < i || (former->a == i && former->b < j))) {
        release(*former++);
      }
      if (former != former_.end() && former->a == i && former->b == j) {
        pairs_.push_back(*former++);
      } else {
        pairs_.push_back({i, j, btVector3(0, 0, 0), 0, nullptr});
      }
    }
  }
  while (former != former_.end()) release(*former++);
}

bool PieceCollisionAlgorithm::are_apart(PiecePair& pair, const btTransform& a,
                                        const btTransform& b) const {
  const double length = pair.apart.length();
  if (length == 0) return false;
  const ConvexPiece& piece_a = a_.pieces[pair.a];
  const ConvexPiece& piece_b = b_.pieces[pair.b];
  const btVector3 apart = body_a_.getWorldTransform().getBasis() * pair.apart;
  const auto support = [](const ConvexPiece& piece, const btTransform& pose,
                          const btVector3& direction) {
    return pose *
           piece.shape->localGetSupportVertexWithoutMarginNonVirtual(direction * pose.getBasis());
  };
  const double gap = apart.dot(support(piece_a, a, -apart) - support(piece_b, b, apart));
  const double wanted =
      reach_ + piece_a.shape->getMarginNonVirtual() + piece_b.shape->getMarginNonVirtual();
  pair.slack_m = gap / length - wanted;
  return pair.slack_m > 0;
}

void PieceCollisionAlgorithm::collide(PiecePair& pair, const btTransform& a, const btTransform& b,
                                      btManifoldResult& result) {
  const ConvexPiece& piece_a = a_.pieces[pair.a];
  const ConvexPiece& piece_b = b_.pieces[pair.b];
  const btTransform pose_a = a * piece_a.pose;
  const btTransform pose_b = b * piece_b.pose;
  if (are_apart(pair, pose_a, pose_b)) {
    release(pair);
    return;
  }
  pair.slack_m = 0;
  const double gap = resting_gap_m(a_, piece_a, b_, piece_b);
  const std::optional<ClosestPoints> closest = closest_points(
      *piece_a.shape, pose_a, *piece_b.shape, pose_b, reach_ + gap, &depth_solver_, &pair.apart);
  pair.apart = pair.apart * a.getBasis();
  if (closest) {
    if (pair.manifold == nullptr) pair.manifold = m_dispatcher->getNewManifold(&body_a_, &body_b_);
    result.setPersistentManifold(pair.manifold);
    const btVector3& normal = closest->normal_on_b;
    result.addContactPoint(normal, closest->point_on_b + gap * normal, closest->distance - gap);
  }
  if (pair.manifold == nullptr) return;
  result.setPersistentManifold(pair.manifold);
  result.refreshContactPoints();
  result.setPersistentManifold(nullptr);
}

}  // namespace pilesim
