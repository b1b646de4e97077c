// How far bodies of a model are apart, or how deep they overlap, by their collision shapes: exact,
// for who judges where bodies stand. No engine and no skin of one has a part in it.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "geometry/triangle_tree.h"
#include "model/model.h"
#include "model/placed_piece.h"

namespace pilesim {

// A shape where a body stands.
struct PlacedShape {
  uint32_t shape = 0;  // index into Model::shapes
  Pose pose;           // of the body frame in the world
  Bounds box;          // m, world, of its collision shape; empty for a plane
};

class BodyDistances {
 public:
  explicit BodyDistances(const Model& model);  // must outlive it

  PlacedShape place(uint32_t shape, const Pose& pose) const;

  // m; below 0: minus the shortest way that parts them, of the pair of pieces that is deepest in
  // each other. Infinity beyond `reach_m`. For a shape that collides as a mesh the triangles count,
  // not the space that they enclose. At least one of the two has pieces.
  double distance(const PlacedShape& a, const PlacedShape& b, double reach_m) const;

 private:
  double to_plane(const PlacedShape& body, const PlacedShape& plane) const;
  double to_mesh(const PlacedShape& body, const PlacedShape& mesh, double reach_m) const;
  double of_pieces(const PlacedShape& a, const PlacedShape& b, double reach_m) const;
  struct BoxedPiece {
    PlacedPiece piece;
    Bounds box;
  };
  std::vector<BoxedPiece> pieces(const PlacedShape& placed, const Vec3& origin,
                                 const Bounds& nearby, double reach_m) const;

  const Model& model_;
  std::vector<std::vector<PieceCore>> cores_;  // by shape
  std::vector<Bounds> boxes_;                  // by shape, of its mesh where it collides as one
  std::vector<uint32_t> columns_;  // by shape, of height fields, which need no tree; else 0
  std::vector<std::unique_ptr<TriangleTree>>
      trees_;  // by shape, of other meshes that collide as such
};

// `box` and all that is within `by` m of it along an axis.
Bounds widened(Bounds box, double by);

}  // namespace pilesim
