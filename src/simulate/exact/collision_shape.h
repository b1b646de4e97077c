// The collision shape of a body: convex pieces, a plane, or triangles.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "geometry/triangle_tree.h"
#include "model/model.h"
#include "simulate/exact/convex_piece.h"

namespace pilesim::exact {

// The triangles of what does not move by itself, one-sided, with what lies over their edges.
class TriangleSurface {
 public:
  explicit TriangleSurface(const TriangleMesh& mesh);

  struct Face {
    Corners corners;
    Vec3 normal;  // unit
    // Over the edge from each corner: the neighbour's normal, or the face's own where there is
    // none or where the edge is a valley.
    std::array<Vec3, 3> over;
  };
  const TriangleTree& tree() const { return tree_; }
  const Face& face(uint32_t place) const { return faces_[place]; }  // in tree order

  // The normal nearest to `normal`, of body onto surface, with which something that touches the
  // triangle closest at `point` may be pushed: never into the surface beside it.
  Vec3 allowed(uint32_t place, const Vec3& point, const Vec3& normal) const;

 private:
  TriangleTree tree_;
  std::vector<Face> faces_;
};

struct CollisionShape {
  explicit CollisionShape(const ModelShape& shape);

  bool is_plane = false;  // y <= 0 in its frame
  std::vector<ConvexPiece> pieces;
  std::unique_ptr<TriangleSurface> surface;
  Bounds box;           // m, body frame; of a plane empty
  double radius_m = 0;  // about the origin
  double smallest_extent_m = 0;
  double piece_extent_m = 0;     // the least of its pieces'
  Vec3 moments = Vec3::Zero();   // m^2: principal inertia of 1 kg
  Quat axes = Quat::Identity();  // principal axes to body
};

}  // namespace pilesim::exact
