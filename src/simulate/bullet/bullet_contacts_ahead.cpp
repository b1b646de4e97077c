#include "simulate/bullet/bullet_contacts_ahead.h"

#include <BulletCollision/NarrowPhaseCollision/btGjkEpaPenetrationDepthSolver.h>

#include <algorithm>
#include <limits>
#include <optional>
#include <span>

#include "simulate/bullet/bullet_closest_points.h"
#include "simulate/bullet/bullet_contact_solver.h"
#include "simulate/bullet/bullet_plane_collision.h"

namespace pilesim {

namespace {

// Ways up to this cannot skip a contact of the body.
double slow_way(const btRigidBody& body) {
  const auto* dynamic = static_cast<const DynamicBody*>(body.getUserPointer());
  return dynamic != nullptr ? dynamic->fast_motion_m : std::numeric_limits<double>::infinity();
}

double turning_way(const btRigidBody& body, double step_s) {
  const double turn_rate = body.getAngularVelocity().length();
  if (turn_rate == 0) return 0;
  return turn_rate * body.getCollisionShape()->getAngularMotionDisc() * step_s;
}

bool is_plane(const btRigidBody& body) {
  return body.getCollisionShape()->getShapeType() == STATIC_PLANE_PROXYTYPE;
}
bool is_triangles(const btRigidBody& body) {
  return body.getCollisionShape()->getShapeType() == TRIANGLE_MESH_SHAPE_PROXYTYPE;
}
const ConvexPieces& pieces_of(const btRigidBody& body) {
  return *static_cast<const ConvexPieces*>(body.getCollisionShape()->getUserPointer());
}

}  // namespace

double farthest_way(const btRigidBody& body, double step_s) {
  return body.getLinearVelocity().length() * step_s + turning_way(body, step_s);
}

// Two bodies, each with pieces unless it is `b` and a plane or of triangles.
class ContactsAhead::Pair {
 public:
  Pair(ContactsAhead& owner, const btRigidBody& a, const btRigidBody& b, double way_m,
       double step_s)
      : owner_(owner), a_(a), b_(b), way_m_(way_m), step_s_(step_s) {}

  void add() {
    for (const ConvexPiece& piece : pieces_of(a_).pieces) {
      if (is_plane(b_)) {
        add_facing(a_, piece, b_, world_plane(b_));
      } else if (is_triangles(b_)) {
        add_triangles(piece);
      } else {
        for (const ConvexPiece& other : pieces_of(b_).pieces) add_pieces(piece, other);
      }
    }
  }

 private:
  // Of the closest points of two shapes, where those of body a's piece are to be stopped.
  std::optional<ClosestPoints> closest(const ConvexPiece& piece, const btConvexShape& other,
                                       const btTransform& other_pose) const {
    btGjkEpaPenetrationDepthSolver depth_solver;  // what a tip is in already stops the rest
    return closest_points(*piece.shape, a_.getWorldTransform() * piece.pose, other, other_pose,
                          way_m_, &depth_solver);
  }

  void add_pieces(const ConvexPiece& piece, const ConvexPiece& other) {
    if (boxes_are_apart(piece, other)) return;
    const btTransform other_pose = b_.getWorldTransform() * other.pose;
    const std::optional<ClosestPoints> c = closest(piece, *other.shape, other_pose);
    if (!c) return;
    const btVector3& normal = c->normal_on_b;
    const double height = normal.dot(c->point_on_b);
    const double gap = resting_gap_m(pieces_of(a_), piece, pieces_of(b_), other);
    if (piece.half_extent.length2() <= other.half_extent.length2()) {
      add_facing(a_, piece, b_, {normal, height + gap});
    } else {
      add_facing(b_, other, a_, {-normal, gap - height - c->distance});
    }
  }

  // By more than the way, along an axis of either body.
  bool boxes_are_apart(const ConvexPiece& piece, const ConvexPiece& other) const {
    const btTransform b_from_a = b_.getWorldTransform().inverseTimes(a_.getWorldTransform());
    const btMatrix3x3& axes = b_from_a.getBasis();
    const btMatrix3x3 sizes = axes.absolute();
    const btVector3 way(way_m_, way_m_, way_m_);
    const btVector3 between = b_from_a * piece.centre - other.centre;
    const auto parted = [](const btVector3& gap) { return gap[gap.maxAxis()] > 0; };
    return parted(between.absolute() - sizes * piece.half_extent - other.half_extent - way) ||
           parted((between * axes).absolute() - piece.half_extent - other.half_extent * sizes -
                  way);
  }

  void add_triangles(const ConvexPiece& piece) {
    struct Callback final : btTriangleCallback {
      Callback(Pair& p, const ConvexPiece& c) : pair(p), piece(c) {}
      void processTriangle(btVector3* corners, int, int) override {
        btTriangleShape triangle(corners[0], corners[1], corners[2]);
        triangle.setMargin(0);
        const auto c = pair.closest(piece, triangle, pair.b_.getWorldTransform());
        if (!c) return;
        pair.add_facing(pair.a_, piece, pair.b_,
                        {c->normal_on_b, c->normal_on_b.dot(c->point_on_b) + skin_m(*piece.shape)});
      }
      Pair& pair;
      const ConvexPiece& piece;
    };
    const btTransform b_from_piece =
        b_.getWorldTransform().inverseTimes(a_.getWorldTransform() * piece.pose);
    btVector3 low, high;
    piece.shape->getAabb(b_from_piece, low, high);
    const btVector3 way(way_m_, way_m_, way_m_);
    Callback callback(*this, piece);
    static_cast<const btBvhTriangleMeshShape*>(b_.getCollisionShape())
        ->processAllTriangles(&callback, low - way, high + way);
  }

  // Stops those points of a piece of `body` that would cross the plane, a part of `other`.
  void add_facing(const btRigidBody& body, const ConvexPiece& piece, const btRigidBody& other,
                  const Plane& plane) {
    std::vector<FacingPoint>& points = owner_.points_;
    points.clear();
    append_facing_points(piece, body.getWorldTransform(), plane, way_m_, 0, points);
    std::erase_if(points, [&](const FacingPoint& p) {
      const btVector3 velocity =
          velocity_at(body, p.point) - velocity_at(other, p.point - p.height * plane.normal);
      return p.height <= 0 || p.height + velocity.dot(plane.normal) * step_s_ >= 0;
    });
    if (points.empty()) return;
    keep_widest_four(plane, 1, points);
    if (points.size() > 1) {
      // Where the points' mean stops the body first, little is left to the points, and a few sweeps
      // of the solver suffice.
      FacingPoint mean{btVector3(0, 0, 0), 0, 0};
      const auto share = 1 / static_cast<double>(points.size());
      for (const FacingPoint& p : points) {
        mean.point += share * p.point;
        mean.height += share * p.height;
      }
      add_contacts(body, other, plane, {&mean, 1});
    }
    add_contacts(body, other, plane, points);
  }

  void add_contacts(const btRigidBody& body, const btRigidBody& other, const Plane& plane,
                    std::span<const FacingPoint> points) {
    btPersistentManifold& manifold = *owner_.dispatcher_.getNewManifold(&body, &other);
    owner_.manifolds_.push_back(&manifold);
    for (const FacingPoint& p : points) {
      manifold.addManifoldPoint(facing_contact(p, plane, body, other));
    }
  }

  static btVector3 velocity_at(const btRigidBody& body, const btVector3& point) {
    return body.getVelocityInLocalPoint(point - body.getWorldTransform().getOrigin());
  }

  ContactsAhead& owner_;
  const btRigidBody& a_;
  const btRigidBody& b_;
  double way_m_;
  double step_s_;
};

void ContactsAhead::add(const btBroadphasePairArray& pairs, double step_s) {
  for (int i = 0; i < pairs.size(); ++i) {
    const auto* a = static_cast<const btRigidBody*>(pairs[i].m_pProxy0->m_clientObject);
    const auto* b = static_cast<const btRigidBody*>(pairs[i].m_pProxy1->m_clientObject);
    if (!a->isActive() && !b->isActive()) continue;
    const double way_m = (a->getLinearVelocity() - b->getLinearVelocity()).length() * step_s +
                         turning_way(*a, step_s) + turning_way(*b, step_s);
    if (way_m <= std::min(slow_way(*a), slow_way(*b))) continue;
    if (!dispatcher_.needsCollision(a, b)) continue;
    if (is_plane(*a) || is_triangles(*a)) std::swap(a, b);
    Pair(*this, *a, *b, way_m, step_s).add();
  }
}

void ContactsAhead::clear() {
  for (btPersistentManifold* manifold : manifolds_) dispatcher_.releaseManifold(manifold);
  manifolds_.clear();
}

}  // namespace pilesim
