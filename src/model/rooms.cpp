#include "model/rooms.h"

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "geometry/inside_test.h"
#include "geometry/triangle_tree.h"

namespace pilesim {
namespace {

constexpr size_t kMostAsked = 256;  // of many, each so manieth

// What the mesh encloses, where it stands.
class Inside {
 public:
  Inside(const TriangleMesh& mesh, const Pose& pose)
      : mesh_(mesh), pose_(pose), box_(mesh.bounds()) {}
  // With all that is nearer than `radius_m`: what is only sunk into ground is not in it.
  bool contains(const Vec3& place, double radius_m) {
    const Vec3 at = pose_.orientation.conjugate() * (place - pose_.position);
    if (!box_.contains(at)) return false;
    if (!solid_) {
      solid_.emplace(mesh_);
      walls_.emplace(mesh_);
    }
    return solid_->contains(at) && walls_->distance(at) > radius_m;
  }

 private:
  const TriangleMesh& mesh_;
  const Pose& pose_;
  Bounds box_;
  std::optional<InsideTest> solid_;
  std::optional<TriangleTree> walls_;
};

template <typename T>
std::vector<T> some_of(std::vector<T> all) {
  const size_t stride = std::max<size_t>(1, all.size() / kMostAsked);
  std::vector<T> some;
  for (size_t i = 0; i < all.size(); i += stride) some.push_back(all[i]);
  return some;
}

void turn(TriangleMesh& mesh) {
  for (Triangle& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
  for (TextureCorners& corners : mesh.texture_map.corners) std::swap(corners[1], corners[2]);
}

std::vector<uint32_t> bodies_that_move(const Model& model) {
  std::vector<uint32_t> bodies;
  for (uint32_t i = 0; i < model.bodies.size(); ++i) {
    const bool fills = model.guide_fill && model.guide_fill->contains(i);
    if (model.bodies[i].role == Role::dynamic && !fills) bodies.push_back(i);
  }
  return bodies;
}

}  // namespace

void open_rooms(Model& model) {
  const std::vector<uint32_t> bodies = some_of(bodies_that_move(model));
  const std::vector<Vec3> guide =
      model.guide_fill ? some_of(model.guide.vertices) : std::vector<Vec3>();
  for (const ModelBody& walls : model.bodies) {
    ModelShape& shape = model.shapes[walls.shape];
    if (!shape.collides_as_mesh) continue;
    Inside inside(shape.mesh, walls.pose);
    const bool holds_a_body = std::ranges::any_of(bodies, [&](uint32_t i) {
      const ModelBody& body = model.bodies[i];
      return inside.contains(body.pose.position, model.shapes[body.shape].bounding_radius);
    });
    const bool holds_the_guide =
        !guide.empty() &&
        std::ranges::all_of(guide, [&](const Vec3& vertex) { return inside.contains(vertex, 0); });
    if (!holds_a_body && !holds_the_guide) continue;
    turn(shape.mesh);
    shape.collision_report += "; a room: touched from inside, as bodies begin there";
  }
}

}  // namespace pilesim
