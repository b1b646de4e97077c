// Generalised winding numbers of many points: far triangles count as dipoles (Barill et al. 2018),
// good to some hundredths. Where it matters whether a point is inside, InsideTest decides.
#pragma once

#include <optional>
#include <vector>

#include "geometry/box_tree.h"
#include "geometry/inside_test.h"
#include "geometry/triangle_tree.h"

namespace pilesim {

class FastWinding {
 public:
  explicit FastWinding(const TriangleMesh& mesh);

  const TriangleTree& triangles() const { return tree_; }
  bool contains(const Vec3& point) const { return side(point, 0).is_inside; }
  // Whether a point is inside, and up to which distance from it others are that no triangle parts
  // from it: any of a closed mesh, else at most `most_m`, and 0 near to an edge of an opening.
  struct Side {
    bool is_inside;
    double reach_m;
  };
  Side side(const Vec3& point, double most_m) const;
  double exact(const Vec3& point) const { return exact_.winding_number(point); }

 private:
  // Edges with more triangles along them one way than the other.
  struct Border {
    BoxTree tree;
    std::vector<double> length_m;  // (node) of its edges, each as often as it is left
  };

  double approximate(const Vec3& point) const;
  static std::optional<Border> border_of(const TriangleMesh& mesh);
  double fastest_change(const Vec3& point, double around_m) const;

  struct Dipole {
    Vec3 centre;  // of area
    Vec3 normal;  // summed, times area, m^2
    double radius;
  };
  TriangleTree tree_;
  InsideTest exact_;
  std::vector<Dipole> dipoles_;   // per node
  std::optional<Border> border_;  // none: the mesh is closed
};

}  // namespace pilesim
