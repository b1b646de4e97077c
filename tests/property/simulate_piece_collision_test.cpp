#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "simulate/bullet/bullet_collision_configuration.h"
#include "simulate/bullet/bullet_shapes.h"
#include "support/small_model.h"

#include <BulletCollision/NarrowPhaseCollision/btGjkEpaPenetrationDepthSolver.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkPairDetector.h>

namespace pilesim {
namespace {

// A body of tetrahedra and boxes strewn about its origin.
ModelShape strewn_pieces(std::mt19937& random, size_t count) {
  std::uniform_real_distribution<double> place(-0.5, 0.5);
  std::uniform_real_distribution<double> size(0.05, 0.3);
  ModelShape shape;
  shape.smallest_extent = 0.05;
  shape.mass = box_mass_properties(Vec3::Ones());
  for (size_t i = 0; i < count; ++i) {
    CollisionPiece piece;
    piece.pose.position = {place(random), place(random), place(random)};
    if (i % 2 == 0) {
      piece.kind = CollisionPiece::Kind::box;
      piece.size = {size(random), size(random), size(random)};
    } else {
      piece.kind = CollisionPiece::Kind::hull;
      const double s = size(random);
      piece.hull.vertices = {{0, 0, 0}, {s, 0, 0}, {0, s, 0}, {0, 0, s}};
      piece.hull.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
    }
    shape.pieces.push_back(piece);
  }
  return shape;
}

struct Nearest final : btDiscreteCollisionDetectorInterface::Result {
  void setShapeIdentifiersA(int, int) override {}
  void setShapeIdentifiersB(int, int) override {}
  void addContactPoint(const btVector3&, const btVector3&, btScalar gap) override {
    distance = std::min<double>(distance, gap);
  }
  double distance = BT_LARGE_FLOAT;
};

// The smallest distance of any piece of one to any piece of the other, each pair from scratch.
double exhaustive_distance(const btCollisionObject& a, const btCollisionObject& b) {
  btGjkEpaPenetrationDepthSolver depth_solver;
  Nearest nearest;
  const auto& pieces_a = *static_cast<const ConvexPieces*>(a.getCollisionShape()->getUserPointer());
  const auto& pieces_b = *static_cast<const ConvexPieces*>(b.getCollisionShape()->getUserPointer());
  for (const ConvexPiece& piece_a : pieces_a.pieces) {
    for (const ConvexPiece& piece_b : pieces_b.pieces) {
      btVoronoiSimplexSolver simplex;
      btGjkPairDetector detector(piece_a.shape, piece_b.shape, &simplex, &depth_solver);
      btGjkPairDetector::ClosestPointInput input;
      input.m_transformA = a.getWorldTransform() * piece_a.pose;
      input.m_transformB = b.getWorldTransform() * piece_b.pose;
      detector.getClosestPoints(input, nearest, nullptr);
    }
  }
  return nearest.distance;
}

std::vector<double> contact_distances(btCollisionDispatcher& dispatcher) {
  std::vector<double> distances;
  for (int m = 0; m < dispatcher.getNumManifolds(); ++m) {
    const btPersistentManifold& manifold = *dispatcher.getManifoldByIndexInternal(m);
    for (int p = 0; p < manifold.getNumContacts(); ++p) {
      distances.push_back(manifold.getContactPoint(p).getDistance());
    }
  }
  return distances;
}

// Two bodies tumble past and through each other: what is known of the step before must never hide
// that they touch. Points of the steps before have their own normals still, along which they may be
// deeper than the bodies are: with them the distance is one of all, without them it is the
// smallest.
class PieceCollision : public testing::TestWithParam<bool> {};

TEST_P(PieceCollision, MissesNoContactOfBodiesThatTumble) {
  const bool with_points_of_before = GetParam();
  std::mt19937 random(11);
  std::uniform_real_distribution<double> number(-1, 1);
  int touching = 0, apart = 0;
  for (int trial = 0; trial < 40; ++trial) {
    const BulletShape shape_a(strewn_pieces(random, 7));
    const BulletShape shape_b(strewn_pieces(random, trial % 3 == 0 ? 1 : 5));
    BulletCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher(&configuration);
    btDbvtBroadphase broad_phase;
    btCollisionWorld world(&dispatcher, &broad_phase, &configuration);
    btCollisionObject a, b;
    a.setCollisionShape(shape_a.collision());
    b.setCollisionShape(shape_b.collision());
    world.addCollisionObject(&a);
    world.addCollisionObject(&b);
    const auto vector = [&] {  // In braces: the order of arguments is the compiler's.
      return btVector3{number(random), number(random), number(random)};
    };
    const btVector3 start = 1.5 * vector();
    const btVector3 axis_a = vector().normalized();
    const btVector3 axis_b = vector().normalized();
    // Slow and fast ones: some trials hardly move in a step.
    const double speed = trial % 2 == 0 ? 1.0 : 0.02;
    for (int step = 0; step < 120; ++step) {
      const double t = speed * step / 60.0;
      a.setWorldTransform(btTransform(btQuaternion(axis_a, 3 * t), start * (1 - t)));
      b.setWorldTransform(btTransform(btQuaternion(axis_b, -5 * t), btVector3(0.1 * t, 0, 0)));
      for (int m = 0; m < dispatcher.getNumManifolds() && !with_points_of_before; ++m) {
        dispatcher.getManifoldByIndexInternal(m)->clearManifold();
      }
      world.performDiscreteCollisionDetection();
      const double reach =
          std::min(a.getCollisionShape()->getContactBreakingThreshold(gContactBreakingThreshold),
                   b.getCollisionShape()->getContactBreakingThreshold(gContactBreakingThreshold));
      const double expected = exhaustive_distance(a, b);
      const std::vector<double> distances = contact_distances(dispatcher);
      double found = BT_LARGE_FLOAT;
      for (const double distance : distances) {
        const bool better = with_points_of_before && expected > 0
                                ? std::abs(distance - expected) < std::abs(found - expected)
                                : distance < found;
        if (better) found = distance;
      }
      if (expected > 0 && expected < 0.98 * reach) {
        ++touching;
        ASSERT_NEAR(found, expected, 1e-4 * reach) << "trial " << trial << ", step " << step;
      } else if (expected <= 0) {
        ++touching;
        // Depths differ with the direction that the search starts from.
        ASSERT_LT(found, 0.1 * reach) << "trial " << trial << ", step " << step;
      } else if (expected > reach) {
        ++apart;
        ASSERT_TRUE(distances.empty()) << "trial " << trial << ", step " << step;
      }
    }
    world.removeCollisionObject(&a);
    world.removeCollisionObject(&b);
  }
  EXPECT_GT(touching, 300);
  EXPECT_GT(apart, 300);
}

INSTANTIATE_TEST_SUITE_P(PointsOfBefore, PieceCollision, testing::Bool());

}  // namespace
}  // namespace pilesim
