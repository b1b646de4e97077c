// Cones, capsules, rings, wedges and letters: the mesh that is drawn, mass and collision pieces.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/round_surface.h"
#include "model/model.h"

namespace pilesim {

// In the shape's own frame.
struct SolidShape {
  TriangleMesh mesh;     // closed
  RoundOutline outline;  // about the y axis, where the mesh stands for that; else empty
  MassProperties mass;   // of the shape itself where it is round, not of the mesh
  std::vector<CollisionPiece> pieces;
  std::string collision_report;
};

// None: `shape` is of another kind. Throws as text_letters(), and Error(input) where letters cannot
// be made solid.
std::optional<SolidShape> solid_shape(const Shape& shape);

// `height` is over all, > 2 radius; the axis is the pose's y.
std::vector<CollisionPiece> capsule_pieces(const Pose& pose, double radius, double height);

}  // namespace pilesim
