#include "model/rooms.h"

#include <algorithm>
#include <iterator>
#include <optional>
#include <utility>
#include <vector>

#include "geometry/inside_test.h"
#include "geometry/mesh_mirror.h"
#include "geometry/triangle_tree.h"

namespace pilesim {
namespace {

constexpr size_t kMostAsked = 256;  // of many, each so manieth

// The inside of a mesh at its pose.
class Inside {
 public:
  Inside(const TriangleMesh& mesh, const Pose& pose)
      : mesh_(mesh), pose_(pose), box_(mesh.bounds()) {}
  bool has_in_box(const Vec3& place) const {
    return box_.contains(pose_.orientation.conjugate() * (place - pose_.position));
  }
  // Includes all points nearer than `radius_m`: objects that only reach into the ground are not in
  // it.
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

// Where bodies that move begin, and how far they reach.
struct Start {
  Vec3 place;
  double radius_m;
};

std::vector<Start> starts_of(const Model& model) {
  std::vector<Start> starts;
  for (uint32_t i = 0; i < model.bodies.size(); ++i) {
    const ModelBody& body = model.bodies[i];
    if (body.role != Role::dynamic || (model.guide_fill && model.guide_fill->contains(i))) continue;
    starts.push_back({body.pose.position, model.shapes[body.shape].bounding_radius});
  }
  return starts;
}

// Vertices of a guide that is to be filled, moved a little inward, since it may stand on the floor.
std::vector<Start> starts_of_guide(const Model& model) {
  constexpr double kWayIn = 0.05;
  std::vector<Start> starts;
  if (!model.guide_fill) return starts;
  const Vec3 middle = model.guide.bounds().center();
  for (const Vec3& vertex : model.guide.vertices) {
    starts.push_back({vertex + kWayIn * (middle - vertex), 0});
  }
  return starts;
}

// Starts within the box of the mesh; others are beside or over it.
std::vector<Start> in_box(const Inside& inside, const std::vector<Start>& starts) {
  std::vector<Start> within;
  std::ranges::copy_if(starts, std::back_inserter(within),
                       [&](const Start& start) { return inside.has_in_box(start.place); });
  return within;
}

bool holds_most(Inside& inside, std::vector<Start> starts) {
  const std::vector<Start> asked = some_of(std::move(starts));
  const auto held = std::ranges::count_if(
      asked, [&](const Start& start) { return inside.contains(start.place, start.radius_m); });
  return 2 * static_cast<size_t>(held) > asked.size();
}

}  // namespace

void open_rooms(Model& model) {
  const std::vector<Start> bodies = starts_of(model), guide = starts_of_guide(model);
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    ModelBody& walls = model.bodies[i];
    const TriangleMesh& mesh = model.shapes[walls.shape].mesh;
    if (!model.shapes[walls.shape].collides_as_mesh || is_sheet(mesh)) continue;
    Inside inside(mesh, walls.pose);
    if (!holds_most(inside, in_box(inside, bodies)) && !holds_most(inside, guide)) continue;
    const auto of_shape = std::ranges::count(model.bodies, walls.shape, &ModelBody::shape);
    if (of_shape > 1) {  // others may be solid
      ModelShape own = model.shapes[walls.shape];
      own.name += " (room)";
      walls.shape = static_cast<uint32_t>(model.shapes.size());
      model.shapes.push_back(std::move(own));
    }
    ModelShape& shape = model.shapes[walls.shape];
    turn_inside_out(shape.mesh);
    shape.collision_report += "; a room: touched from inside, as bodies begin there";
  }
}

}  // namespace pilesim
