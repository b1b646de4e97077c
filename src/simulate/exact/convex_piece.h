// A convex piece of a collision shape as the narrow phase wants it, in the frame of its body.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/types.h"
#include "model/model.h"

namespace pilesim::exact {

// Lanes of the search for the farthest vertex.
inline constexpr size_t kVertexLanes = 8;

// A convex polytope, a round sector, or a point with a radius. Polytopes have all of their faces,
// round ones the flat ones, whose arcs have a corner every turn of 2 pi / kRimPoints at the most;
// those with a margin have none.
class ConvexPiece {
 public:
  enum class Kind { polytope, round, sphere };
  struct Face {
    Vec3 normal;            // unit, outward
    double offset_m;        // normal . x on the face
    uint32_t first, count;  // in loops(): its corners, counter-clockwise from outside
  };
  // For the edge from a face's corner to the next: normal . x > offset is beside the face.
  struct Side {
    Vec3 normal;  // in the face's plane, outward, as long as the edge
    double offset;
  };
  // The points of the lower and of the upper arc of a round piece at one angle, and the normal of
  // the side between them. An arc without height has both in one.
  struct RoundSide {
    Vec3 lower, upper;
    Vec3 normal;  // unit, outward
  };
  static constexpr uint32_t kRimPoints = 16;
  static constexpr uint32_t kNone = ~uint32_t{0};

  explicit ConvexPiece(const CollisionPiece& piece);
  // A triangle as a polytope without volume; its faces are the two sides.
  explicit ConvexPiece(const std::array<Vec3, 3>& corners);
  void become(const std::array<Vec3, 3>& corners);  // of a triangle: another one

  Kind kind() const { return kind_; }
  double radius_m() const { return radius_m_; }   // about the core; of a polytope 0
  const Vec3& centre() const { return centre_; }  // m, of its box
  // Smallest side of its box; infinite for a triangle, whose contacts the other piece scales.
  double smallest_extent_m() const { return smallest_extent_m_; }
  // Radius of the largest ball about centre() inside the core, m.
  double inner_radius_m() const { return inner_radius_m_; }
  const Bounds& box() const { return box_; }
  // The frame of a round piece's sector, and the sector.
  const Vec3& foot() const { return foot_; }         // m, the middle of the axis
  Vec3 axis() const { return sector_turn_.col(1); }  // unit
  const RoundSector& sector() const { return sector_; }
  // None: its round side does not reach to that angle, or `direction` is along the axis.
  std::optional<RoundSide> round_side(const Vec3& direction) const;
  // Whether a normal, unit, of a sector of a ring belongs to the sectors beside it.
  bool is_covered(const Vec3& outward) const;
  // The nearest direction to one that is covered that is not: that of the arc's end.
  Vec3 to_arc(const Vec3& outward) const;
  bool holds(const Vec3& point, double tolerance_m) const;

  const std::vector<Vec3>& vertices() const { return vertices_; }
  const std::vector<Face>& faces() const { return faces_; }
  const std::vector<uint32_t>& loops() const { return loops_; }  // indices into vertices()
  const std::vector<Side>& sides() const { return sides_; }      // one for each of loops()

  // The point of the core farthest along `direction`, of any length but 0, m. Polytopes are
  // searched in floats: the error is below 1e-6 of the extent.
  Vec3 farthest(const Vec3& direction) const;
  uint32_t farthest_vertex(const Vec3& direction) const;  // of a polytope
  // The vertices of a polytope that are as far along `direction`, unit, as `least_m`, or but for
  // rounding, ascending.
  void list_beyond(const Vec3& direction, double least_m, std::vector<uint32_t>& vertices) const;
  // The face whose normal is nearest to `direction`, unit; kNone: there are no faces.
  uint32_t face_along(const Vec3& direction) const;
  // Among the faces at a vertex of a polytope.
  uint32_t face_at(uint32_t vertex, const Vec3& direction) const;

 private:
  void make_round(const CollisionPiece& piece);
  void take_vertices(std::vector<Vec3> vertices);
  void measure();
  void map_faces();
  void find_sides();

  Kind kind_ = Kind::polytope;
  double radius_m_ = 0, smallest_extent_m_ = 0, inner_radius_m_ = 0;
  Vec3 centre_ = Vec3::Zero();
  Bounds box_;
  Vec3 foot_ = Vec3::Zero();
  Mat3 sector_turn_ = Mat3::Identity();
  RoundSector sector_;
  std::vector<Vec3> vertices_;
  std::vector<Face> faces_;
  std::vector<uint32_t> loops_;
  std::vector<Side> sides_;
  std::vector<uint32_t> first_face_of_, faces_of_;  // faces at each vertex, by rows
  // Coordinates in blocks of kVertexLanes x, as many y, as many z; the last block repeats a vertex.
  std::vector<float> vertex_blocks_, normal_blocks_;
};

}  // namespace pilesim::exact
