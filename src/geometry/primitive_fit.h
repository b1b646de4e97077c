// Meshes that stand for a ball, a box, a cylinder, a cone or a capsule.
#pragma once

#include <optional>

#include "geometry/mesh.h"

namespace pilesim {

struct FittedPrimitive {
  enum class Kind { ball, box, cylinder, cone, capsule } kind;
  Pose pose;  // of its middle in the frame of the mesh; its axis is y, the tip of a cone at +y
  // Box: full edges; ball: (r, r, r); others: (r, full height, r); m.
  Vec3 size;
  double surface_error_m = 0;  // the farthest that the hull of the mesh is from it

  double volume_m3() const;
};

// The primitive that the convex hull of `mesh` is, at any place and turn: each corner of the hull
// lies on it to 0.1 % of its smallest extent (0.2 % where the mesh's coordinates are rounded so),
// no face lies farther below it than 1 % of the diameter of a round primitive; a box's faces as its
// corners. So a circle has sixteen corners at least. None: it is none of them. Throws Error(input)
// as convex_hull() does.
std::optional<FittedPrimitive> fit_primitive(const TriangleMesh& mesh);

}  // namespace pilesim
