// Divides a box into cubic cells with indices.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/types.h"
#include "geometry/mesh.h"

namespace pilesim {

struct CellGrid {
  CellGrid() = default;
  // Cells of about `cell_m`, larger if there would be more than `most_cells`.
  CellGrid(const Bounds& box, double cell_m, double most_cells);

  size_t size() const { return count[0] * count[1] * count[2]; }
  Vec3 middle_of(size_t cell) const;
  Vec3 corner_of(size_t cell) const;        // in cells from the lowest corner
  size_t cell_of(const Vec3& point) const;  // size() if outside the box
  // By cell: 1 if its centre lies inside the closed mesh, at least `from_wall_m` from its surface,
  // else 0.
  std::vector<uint8_t> inside(const TriangleMesh& mesh, double from_wall_m) const;

  Vec3 low = Vec3::Zero();  // m
  double cell_m = 0;
  std::array<size_t, 3> count{};
};

}  // namespace pilesim
