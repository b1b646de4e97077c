// Volumes of convex hulls, fast: a search for cuts asks for hundreds of thousands. Unlike
// convex_hull() it builds no mesh and takes flat or empty input (volume 0).
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/types.h"

namespace pilesim {

// Quickhull (Barber et al. 1996) in plain double arithmetic: points within 1e-10 of the extent of a
// face are taken as on it, so volumes are good to about that relative to the extent cubed. Keeps
// its memory from one call to the next; one object a thread.
class HullVolume {
 public:
  // Volume of the hull of `points` (finite). With a `coarseness` (0 .. 0.1) points that stand out
  // by less than this share of the thickness are left out: quicker on rounded bodies, and too small
  // by about that share at most.
  double compute(std::span<const Vec3> points, double coarseness = 0);
  // Indices into the points of the last call of its hull's vertices, ascending.
  std::vector<uint32_t> vertices() const;

 private:
  struct Face {
    std::array<uint32_t, 3> corner;
    std::array<uint32_t, 3> neighbour;  // across the edge from corner k to corner k + 1
    Vec3 normal;
    double offset;
    uint32_t first_outside;  // list of points above the face, through next_outside_
    uint32_t farthest;
    double farthest_distance;
    bool removed, visited;
  };
  struct HorizonEdge {
    uint32_t from, to, outer_face;
  };

  bool start_with_tetrahedron(double coarseness);
  uint32_t add_face(uint32_t a, uint32_t b, uint32_t c);
  void give_point(uint32_t point, uint32_t first_face, uint32_t end_face);
  void collect_horizon(uint32_t start_face, const Vec3& eye, double above);
  bool is_one_ring();
  void leave_out(uint32_t face, uint32_t point);
  void add_point(uint32_t face);

  std::span<const Vec3> points_;
  double tolerance_ = 0;  // m, for points on a plane
  double outside_ = 0;    // m: points less far outside are left out
  std::vector<Face> faces_;
  std::vector<uint32_t> next_outside_;
  std::vector<uint32_t> visible_;
  std::vector<HorizonEdge> horizon_;
  std::vector<uint32_t> face_from_;  // by vertex: the new face whose horizon edge starts there
  std::vector<uint32_t> stack_;
};

}  // namespace pilesim
