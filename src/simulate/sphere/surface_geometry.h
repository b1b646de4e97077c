// Surfaces that forces do not move and spheres collide with: planes and the triangles of static,
// kinematic and fixed bodies.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "core/state_stream.h"
#include "geometry/triangle_tree.h"
#include "model/model.h"
#include "simulate/sphere/convex_extent.h"

namespace pilesim {

// The nearest point of a surface. World frame.
struct SurfaceContact {
  uint32_t body;   // of the model
  Vec3f normal;    // unit, towards the point
  float gap;       // m, from the point; negative behind a plane
  Vec3f velocity;  // m/s, of the surface there
  bool level;      // the surface is horizontal and does not move
  bool face;       // a face contact, not an edge
  float reach_m;   // extent of the body at the point, towards the surface
};

// The shape to test against surfaces: a ball, or a convex hull about its centre.
struct SurfaceProbe {
  Vec3f centre;
  float farthest_m;  // surfaces farther from the centre are ignored,
  float near_m;      // and so are those farther from ball or hull
  float radius_m = 0;
  const ConvexExtent* hull = nullptr;  // used instead of the ball
  Quatf orientation = Quatf::Identity();
};

// A body's surface in the world: everything known of it besides the model.
struct SurfaceState {
  uint32_t body = 0;
  Pose pose;                 // body frame
  Vec3 velocity, turn_rate;  // m/s, rad/s

  static void fields(auto& self, auto& stream) {
    stream(self.body, self.pose, self.velocity, self.turn_rate);
  }
};

class SurfaceGeometry {
 public:
  // `model` must outlive it.
  explicit SurfaceGeometry(const Model& model);

  // Puts a body's shape at `pose` (body frame), or removes it from the world.
  void place(uint32_t body, const Pose& pose, const Vec3& velocity, const Vec3& turn_rate);
  void remove(uint32_t body);

  // In the order of bodies.
  std::vector<SurfaceState> state() const;
  void set_state(const std::vector<SurfaceState>& state);

  // Selects surfaces (for find) that may be nearer than `reach` to a point of the box. Thread-safe.
  void select(const Eigen::AlignedBox3f& box, float reach, std::vector<uint32_t>& surfaces) const;

  // The body of a surface.
  uint32_t body(uint32_t surface) const { return placed_[surface].body; }

  // Appends the contacts with surfaces near one of them: one per direction, at most kMostContacts,
  // the deepest ones. Thread-safe.
  void find(uint32_t surface, const SurfaceProbe& probe,
            std::vector<SurfaceContact>& contacts) const;

  // True if a surface of the body may touch the sphere.
  bool may_touch(uint32_t body, const Vec3f& centre, float radius) const;

  // First intersection of a point that moves from `from` to `to` with a plane or a triangle, as a
  // share of the segment; 1 if there is none.
  double first_hit(const Vec3& from, const Vec3& to) const;

  static constexpr size_t kMostContacts = 4;

 private:
  struct MeshSurface {
    explicit MeshSurface(const TriangleMesh& mesh);
    TriangleTree tree;
    std::vector<Vec3> outward;  // of its triangles, unit; in tree order
  };
  struct LazyMesh;
  struct Placed : SurfaceState {
    bool is_plane;
    Vec3 normal;                             // of a plane
    Bounds box;                              // of a mesh, world frame
    const LazyMesh* mesh;                    // null for a plane
    std::optional<SurfaceVelocity> running;  // world
  };
  // Built when a search first comes near it, so that checking a scene does not need it.
  struct LazyMesh {
    explicit LazyMesh(const TriangleMesh& of_mesh) : mesh(of_mesh), box(of_mesh.bounds()) {}
    const MeshSurface* operator->() const {
      std::call_once(once, [&] { made.emplace(mesh); });
      return &*made;
    }
    const TriangleMesh& mesh;
    Bounds box;
    mutable std::once_flag once;
    mutable std::optional<MeshSurface> made;
  };
  class MeshSearch;
  static Vec3 velocity_at(const Placed& placed, const Vec3& normal, const Vec3& arm);
  static SurfaceContact contact_of(const Placed& placed, const Vec3& normal, double gap,
                                   bool is_face, const SurfaceProbe& probe);
  static void find_on_mesh(const Placed& placed, const SurfaceProbe& probe,
                           std::vector<SurfaceContact>& contacts);

  const Model& model_;
  std::vector<std::unique_ptr<LazyMesh>> meshes_;  // by shape
  std::vector<Placed> placed_;                     // in the order of bodies
};

}  // namespace pilesim
