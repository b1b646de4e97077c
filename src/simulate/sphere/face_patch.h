// Blocks, bodies that nearly fill their box, and the patch on which two of them rest.
#pragma once

#include <optional>

#include "core/types.h"
#include "geometry/mesh.h"

namespace pilesim {

// About the centre of mass, along the body's axes.
struct BlockShape {
  Vec3f centre = Vec3f::Zero();  // m, of the box
  Vec3f half_m = Vec3f::Zero();  // its half sides
};

// The block of a solid mesh in its body frame; none if it fills less than kBlockFill of its box.
std::optional<BlockShape> block_shape(const TriangleMesh& mesh, double volume_m3);

// A block in the world.
struct PlacedBlock {
  PlacedBlock(const BlockShape& shape, const Vec3f& position, const Quatf& orientation)
      : axes(orientation.toRotationMatrix()),
        centre(position + axes * shape.centre),
        half_m(shape.half_m) {}
  Eigen::Matrix3f axes;  // unit, columns
  Vec3f centre, half_m;  // m
};

// World frame, of a relative to b: one block's plane with the other's nearest face on it.
struct FacePatch {
  Vec3f normal;  // unit, from b to a
  float gap_m;   // below 0 where they penetrate
  Vec3f middle;  // m, of the shared area
  Vec3f along;   // unit, in the plane; the other axis is normal x along
  float half_along_m, half_across_m;
  Vec3f tilt;     // rad, rotation of a that makes the faces parallel
  float twist_m;  // mean lever of friction against twisting
};

// None if they are farther apart than `reach_m`, or their faces do not overlap: along an edge, at a
// corner, or side by side. Edges count by their adjacent faces.
std::optional<FacePatch> patch_between(const PlacedBlock& a, const PlacedBlock& b, float reach_m);

// With a plane whose upward normal is `normal`, `height_m` below the centre of mass `position`.
FacePatch patch_on_plane(const PlacedBlock& a, const Vec3f& position, const Vec3f& normal,
                         float height_m);

}  // namespace pilesim
