// The mesh of a shape as other programs take it.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/types.h"
#include "trajectory/trajectory.h"

namespace pilesim {

struct ExportMesh {
  std::vector<Vec3f> points;      // m, body frame; no two at one place
  std::vector<uint32_t> corners;  // (3 T) indices into points
  // (3 T) indices into split_points: points with a normal each, several at a crease.
  std::vector<uint32_t> split_corners;
  std::vector<Vec3f> split_points, split_normals;  // m; unit
  std::vector<Colour> colours;                     // (T) of its file, or empty
  float radius_m = 0;                              // of the sphere about the origin that holds it
};

// A plane becomes a square about its origin that reaches `plane_reach_m` each way.
ExportMesh make_export_mesh(const TrajectoryShape& shape, float plane_reach_m);

}  // namespace pilesim
