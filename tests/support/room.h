// A room: a box with its faces outward.
#pragma once

#include <utility>

#include "model/rooms.h"
#include "support/small_model.h"

namespace pilesim {

// A box of 4 x 3 x 4 m with its triangles as collision shape and its low side at 0, and a cube of
// 0.2 m.
struct Room : SmallModel {
  explicit Room(const Vec3& cube_at, bool is_inward = false) {
    const uint32_t stone = material(0, 0.5), walls = box({4, 3, 4});
    cube = box(Vec3::Constant(0.2));
    ModelShape& shape = model.shapes[walls];
    shape.pieces.clear();
    shape.collides_as_mesh = true;
    if (is_inward) {
      for (Triangle& t : shape.mesh.triangles) std::swap(t[1], t[2]);
    }
    body(walls, stone, {0, 1.5, 0}, Role::fixed);
    body(cube, stone, cube_at);
    before = model.shapes[walls].mesh;
    open_rooms(model);
  }
  bool is_open() const { return model.shapes[0].mesh.triangles != before.triangles; }
  TriangleMesh before;
  uint32_t cube;
};

}  // namespace pilesim
