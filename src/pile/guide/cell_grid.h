// A box in cubic cells, by index.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/types.h"
#include "geometry/mesh.h"

namespace pilesim {

struct CellGrid {
  CellGrid() = default;
  // Cells of about `cell_m`, larger where that would be more than `most_cells`.
  CellGrid(const Bounds& box, double cell_m, double most_cells);

  size_t size() const { return count[0] * count[1] * count[2]; }
  Vec3 middle_of(size_t cell) const;
  Vec3 corner_of(size_t cell) const;        // in cells from the lowest corner
  size_t cell_of(const Vec3& point) const;  // size(): out of the box
  // By cell: 1 if its middle lies inside the closed mesh and no nearer than `from_wall_m` to its
  // surface, else 0.
  std::vector<uint8_t> inside(const TriangleMesh& mesh, double from_wall_m) const;

  Vec3 low = Vec3::Zero();  // m
  double cell_m = 0;
  std::array<size_t, 3> count{};
};

}  // namespace pilesim
