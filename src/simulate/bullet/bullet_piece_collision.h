// Contacts between bodies made of convex pieces.
#pragma once

#include <vector>

#include "simulate/bullet/bullet_algorithms.h"
#include "simulate/bullet/bullet_types.h"

namespace pilesim {

// A convex piece of a collision shape. A shape's user pointer leads to its ConvexPieces.
struct ConvexPiece {
  btTransform pose;  // of `shape` in the body's Bullet frame
  const btConvexShape* shape;
  btVector3 centre;       // m, of the piece's box in the body's Bullet frame, margin included
  btVector3 half_extent;  // m
};
struct ConvexPieces {
  std::vector<ConvexPiece> pieces;
  btVector3 centre, half_extent;  // m, of the box about all pieces
  double most_gap_m = 0;          // to what it rests on
};

// The gap that contacts leave between the surfaces of two pieces, m. Hulls keep one: with none
// between them the direction in which they touch is lost in rounding. It does not grow with the
// larger body.
double resting_gap_m(const ConvexPieces& body_a, const ConvexPiece& a, const ConvexPieces& body_b,
                     const ConvexPiece& b);

// Pairs of pieces whose boxes nearly meet are listed; the list holds until the bodies have moved so
// far against each other that a new pair could touch. Each pair keeps how far it was apart, less
// the motion since, and in which direction: most pairs cost nothing in a step, some two support
// points, and only what touches, or nearly, goes through GJK and has contact points. Stock Bullet
// runs GJK from scratch on each pair and searches two trees for them.
class PieceCollisionAlgorithm final : public PairAlgorithm {
 public:
  PieceCollisionAlgorithm(const btCollisionAlgorithmConstructionInfo& info,
                          const btCollisionObject& a, const btCollisionObject& b,
                          btConvexPenetrationDepthSolver& depth_solver);
  ~PieceCollisionAlgorithm() override;

  void processCollision(const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b,
                        const btDispatcherInfo& info, btManifoldResult* result) override;
  void getAllContactManifolds(btManifoldArray& manifolds) override;

  BulletAlgorithm kind() const override { return BulletAlgorithm::pieces; }
  void save(BulletPair& state) const override;
  void load(const BulletPair& state, ManifoldPlaces& places) override;

 private:
  struct PiecePair {  // as BulletPiecePair
    uint32_t a, b;
    btVector3 apart;
    double slack_m;
    btPersistentManifold* manifold;
  };

  double motion_since_last_step(const btTransform& b_from_a);
  void list_pairs(const btTransform& b_from_a);
  bool are_apart(PiecePair& pair, const btTransform& a, const btTransform& b) const;
  void collide(PiecePair& pair, const btTransform& a, const btTransform& b,
               btManifoldResult& result);
  void release(PiecePair& pair);

  const ConvexPieces& a_;
  const ConvexPieces& b_;
  const btCollisionObject& body_a_;
  const btCollisionObject& body_b_;
  btConvexPenetrationDepthSolver& depth_solver_;
  double reach_;                   // m: pieces closer than this have contact points
  double radius_a_;                // m, of the ball about body a's origin that holds it
  btTransform b_from_a_;           // in the step before
  double list_slack_m_ = -1;       // motion until `pairs_` may miss one
  std::vector<PiecePair> pairs_;   // by a, then b
  std::vector<PiecePair> former_;  // scratch
};

}  // namespace pilesim
