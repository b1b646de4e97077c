// Regions of a plane inside closed outlines, with holes: as triangles, as convex polygons, and
// extruded to solids.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "geometry/mesh.h"

namespace pilesim {

using FlatPoint = Eigen::Vector2d;
using Outline = std::vector<FlatPoint>;  // closed, without its first point again

// The inside of one outline, without its holes.
struct FlatRegion {
  std::vector<FlatPoint> points;
  // Indices of points, the region on their left: the outer one, counter-clockwise, then holes.
  std::vector<std::vector<uint32_t>> outlines;
  std::vector<Triangle> triangles;  // that fill it, counter-clockwise

  double area() const;
};

// The regions of a letter's outlines: the largest one and all that run like it are each the outer
// one of a region, others are holes. Regions may overlap. Coordinates are of the order of 1. Points
// on a straight line between their neighbours are left out, and outlines without area. None: an
// outline crosses or touches itself or one of its holes, or a hole is in no region.
std::optional<std::vector<FlatRegion>> fill_outlines(const std::vector<Outline>& outlines);

// Convex polygons that fill the region without overlap: its triangles, joined while that is convex.
std::vector<std::vector<uint32_t>> convex_polygons(const FlatRegion& region);

// The region in the x-y plane as a closed solid, from z = -depth / 2 to depth / 2.
TriangleMesh extruded(const FlatRegion& region, double depth);

}  // namespace pilesim
