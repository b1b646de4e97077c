// Finds room for bodies in a guide: cells that are inside it and not covered by a body.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/philox.h"
#include "model/model.h"
#include "pile/guide/cell_grid.h"
#include "pile/guide/obstacle.h"

namespace pilesim {

// Points on the surface and in the interior of a shape, body frame, m, about `spacing_m` apart.
std::vector<Vec3> points_of(const ModelShape& shape, double spacing_m);

class Room {
 public:
  // Cells of about `cell_m`, larger if there would be more than a few million.
  Room(const TriangleMesh& guide, double cell_m);

  double cell_m() const { return grid_.cell_m; }
  // Blocks all cells inside the obstacle or within `near_m` of it; true if any were free.
  bool block(const Obstacle& obstacle, double near_m);
  void clear();
  void cover(const Pose& pose, std::span<const Vec3> points);
  // Finds a random pose with all points in free cells; false if all its attempts fail.
  bool find(std::span<const Vec3> points, Philox& draws, Pose& pose) const;
  // Number of free cells.
  size_t free_cells() const { return free_.size(); }
  // Lists the free cells; call it before find() and after cover().
  void list_free();

 private:
  static constexpr uint8_t kOutside = 1, kCovered = 2;

  CellGrid grid_;
  std::vector<uint8_t> cells_;
  std::vector<uint32_t> free_;
};

}  // namespace pilesim
