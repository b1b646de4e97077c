// Where in a guide there is room for a body: cells that are inside and that no body covers.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/philox.h"
#include "model/model.h"
#include "pile/guide/cell_grid.h"
#include "pile/guide/obstacle.h"

namespace pilesim {

// Points over the surface and through the inside of a shape, body frame, m: neighbours are about
// `spacing_m` apart.
std::vector<Vec3> points_of(const ModelShape& shape, double spacing_m);

class Room {
 public:
  // Cells of about `cell_m`, larger where that would be more than a few million.
  Room(const TriangleMesh& guide, double cell_m);

  double cell_m() const { return grid_.cell_m; }
  // Leaves no room inside of it or nearer than `near_m` to it; whether any was there.
  bool block(const Obstacle& obstacle, double near_m);
  void clear();
  void cover(const Pose& pose, std::span<const Vec3> points);
  // A pose at random at which all points are in free cells; false: `draws` gave none.
  bool find(std::span<const Vec3> points, Philox& draws, Pose& pose) const;
  // Cells that are free.
  size_t free_cells() const { return free_.size(); }
  // Lists them; before find() and after cover().
  void list_free();

 private:
  static constexpr uint8_t kOutside = 1, kCovered = 2;

  CellGrid grid_;
  std::vector<uint8_t> cells_;
  std::vector<uint32_t> free_;
};

}  // namespace pilesim
