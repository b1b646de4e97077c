// The collision shape of a body: convex pieces, a plane, or triangles.
#pragma once

#include <algorithm>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "geometry/triangle_tree.h"
#include "model/model.h"
#include "simulate/exact/convex_piece.h"

namespace pilesim::exact {

// The nearest to `normal` that points into none of `constraints` (unit directions into what is
// solid), or zero: the projection onto their polar cone, by which constraints it lies on.
Vec3 out_of(const Vec3& normal, std::span<const Vec3> constraints);

// Triangles with what lies over their edges. One that is solid behind its faces, as a closed one
// is, is touched from outside, another from either side.
class TriangleSurface {
 public:
  TriangleSurface(const TriangleMesh& mesh, bool solid_behind);

  // Valid while the surface is.
  struct Face {
    const Corners& corners;
    const Vec3& normal;  // unit
  };
  const TriangleTree& tree() const { return tree_; }
  Face face(uint32_t place) const { return {tree_.corners()[place], normals_[place]}; }
  // Over the edge from each corner, in tree order; the face itself where there is none.
  const std::array<uint32_t, 3>& neighbours(uint32_t place) const { return edges_[place].over; }
  // Whether the surface on that `side` (1 or -1) rises beyond the edge from that corner.
  bool is_valley(uint32_t place, size_t corner, int side) const {
    return edges_[place].ridge[corner] == -side;
  }
  bool is_solid() const { return is_closed_ || solid_behind_; }
  // Nothing comes to a face from behind: there is no other side, as under a height field.
  bool has_one_side() const { return solid_behind_; }
  // Whether a triangle of a height field is above the point, along y.
  bool is_below(const Vec3& point) const;

  // The normal nearest to `normal`, of the surface, with which something on that `side` (1 or -1)
  // that touches the triangle closest at `point` may be pushed: never into the surface beside it.
  Vec3 allowed(uint32_t place, int side, const Vec3& point, const Vec3& normal) const;

 private:
  Vec3 off_vertex(uint32_t place, size_t corner, int side, const Vec3& normal) const;

  static constexpr int8_t kBorder = 2;
  // Over the edge from each corner of a triangle: the place of its neighbour (where there is none,
  // its own), and whether that falls away from this side (1), from the other (-1), or neither (0);
  // kBorder: there is none.
  struct Edges {
    std::array<uint32_t, 3> over;
    std::array<int8_t, 3> ridge{};
  };

  TriangleTree tree_;
  std::vector<Vec3> normals_;  // in tree order, as are
  std::vector<Edges> edges_;
  bool is_closed_ = true, solid_behind_;
};

// A surface that is made when it is first asked for, by any thread: who only checks a scene does
// without. A large mesh takes seconds and gigabytes.
class LazySurface {
 public:
  LazySurface() = default;
  LazySurface(const TriangleMesh& mesh, bool solid_behind)
      : state_(std::make_unique<State>(&mesh, solid_behind)) {}
  explicit operator bool() const { return state_ != nullptr; }
  bool operator==(std::nullptr_t) const { return state_ == nullptr; }
  const TriangleSurface& operator*() const { return *operator->(); }
  const TriangleSurface* operator->() const {
    std::call_once(state_->once,
                   [&] { state_->surface.emplace(*state_->mesh, state_->solid_behind); });
    return &*state_->surface;
  }

 private:
  struct State {
    State(const TriangleMesh* of, bool solid) : mesh(of), solid_behind(solid) {}
    const TriangleMesh* mesh;
    bool solid_behind;
    std::once_flag once;
    std::optional<TriangleSurface> surface;
  };
  std::unique_ptr<State> state_;
};

// `shape` outlives it.
struct CollisionShape {
  explicit CollisionShape(const ModelShape& shape);
  // By which contacts are measured: of the smallest piece; of a plane or a surface infinite, as
  // what meets them is what counts. m
  double own_extent() const {
    return is_plane || surface ? std::numeric_limits<double>::infinity() : piece_extent_m;
  }

  bool is_plane = false;  // y <= 0 in its frame
  std::vector<ConvexPiece> pieces;
  LazySurface surface;
  Bounds box;                   // m, body frame; of a plane empty
  double radius_m = 0;          // about the origin
  double turning_radius_m = 0;  // the same, but of a ball about its centre 0: it stays as it turns
  double smallest_extent_m = 0;
  double piece_extent_m = 0;     // the least of its pieces'
  Vec3 moments = Vec3::Zero();   // m^2: principal inertia of 1 kg
  Quat axes = Quat::Identity();  // principal axes to body
};

inline double smaller_extent(const CollisionShape& a, const CollisionShape& b) {
  return std::min(a.own_extent(), b.own_extent());
}

}  // namespace pilesim::exact
