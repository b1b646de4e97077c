// A convex piece of a collision shape as the narrow phase wants it, in the frame of its body.
#pragma once

#include <cstdint>
#include <vector>

#include "core/types.h"
#include "model/model.h"

namespace pilesim::exact {

// Lanes of the search for the farthest vertex.
inline constexpr size_t kVertexLanes = 8;

// A convex polytope, a cylinder, or a point with a radius. Polytopes have all of their faces,
// cylinders the two flat ones, with a rim of kRimPoints points.
class ConvexPiece {
 public:
  enum class Kind { polytope, cylinder, sphere };
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
  static constexpr uint32_t kRimPoints = 16;
  static constexpr uint32_t kNone = ~uint32_t{0};

  explicit ConvexPiece(const CollisionPiece& piece);
  // A triangle as a polytope without volume; its faces are the two sides.
  explicit ConvexPiece(const std::array<Vec3, 3>& corners);
  void become(const std::array<Vec3, 3>& corners);  // of a triangle: another one

  Kind kind() const { return kind_; }
  double radius_m() const { return radius_m_; }   // about the core: of a sphere; else 0
  const Vec3& centre() const { return centre_; }  // m, of its box
  // Smallest side of its box; infinite for a triangle, whose contacts the other piece scales.
  double smallest_extent_m() const { return smallest_extent_m_; }
  // Radius of the largest ball about centre() inside the core, m.
  double inner_radius_m() const { return inner_radius_m_; }
  const Bounds& box() const { return box_; }
  // A cylinder's axis, unit, half of its height and its radius, m.
  const Vec3& axis() const { return axis_; }
  double half_height_m() const { return half_height_m_; }
  double round_m() const { return round_m_; }

  const std::vector<Vec3>& vertices() const { return vertices_; }
  const std::vector<Face>& faces() const { return faces_; }
  const std::vector<uint32_t>& loops() const { return loops_; }  // indices into vertices()
  const std::vector<Side>& sides() const { return sides_; }      // one for each of loops()

  // The point of the core farthest along `direction`, of any length but 0, m. Polytopes are
  // searched in floats: the error is below 1e-6 of the extent.
  Vec3 farthest(const Vec3& direction) const;
  uint32_t farthest_vertex(const Vec3& direction) const;  // of a polytope
  // The face whose normal is nearest to `direction`, unit; kNone: there are no faces.
  uint32_t face_along(const Vec3& direction) const;
  // Among the faces at a vertex of a polytope.
  uint32_t face_at(uint32_t vertex, const Vec3& direction) const;

 private:
  void take_vertices(std::vector<Vec3> vertices);
  void measure();
  void map_faces();
  void find_sides();

  Kind kind_ = Kind::polytope;
  double radius_m_ = 0, smallest_extent_m_ = 0, inner_radius_m_ = 0;
  Vec3 centre_ = Vec3::Zero();
  Bounds box_;
  Vec3 axis_ = Vec3::UnitY();
  double half_height_m_ = 0, round_m_ = 0;
  std::vector<Vec3> vertices_;
  std::vector<Face> faces_;
  std::vector<uint32_t> loops_;
  std::vector<Side> sides_;
  std::vector<uint32_t> first_face_of_, faces_of_;  // faces at each vertex, by rows
  // Coordinates in blocks of kVertexLanes x, as many y, as many z; the last block repeats a vertex.
  std::vector<float> vertex_blocks_, normal_blocks_;
};

}  // namespace pilesim::exact
