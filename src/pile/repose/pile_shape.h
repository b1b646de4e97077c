// The ideal form of a pile: slopes of one angle that descend on all sides of its core, cut by
// walls. A core of one point gives the cone of the dissertation's section 5.2.1.
#pragma once

#include <vector>

#include "core/types.h"
#include "scene/scene.h"

namespace pilesim {

// Heights are over the base. `reach` is the distance of the foot from the core (the radius of a
// cone, before walls cut it). The surface over a point at distance d from the core has the height
// (reach - d) tan(angle).
class PileShape {
 public:
  // The core is `pile`'s footprint or centre, else `centre`.
  PileShape(const Pile& pile, const GroundPoint& centre);

  double distance(const GroundPoint& point) const;      // m, to the core; 0 inside
  GroundPoint outward(const GroundPoint& point) const;  // unit, away from the core; zero inside
  bool inside_walls(const GroundPoint& point) const;    // always true without walls
  GroundPoint middle() const;
  // Position of a point outside the core along the line at `distance_m` around the core: a share in
  // [0, 1).
  double way_round(const GroundPoint& point, double distance_m) const;
  double way_round_m(double distance_m) const { return core_perimeter_ + 2 * kPi * distance_m; }
  const std::vector<GroundPoint>& core() const { return core_; }  // a polygon is counter-clockwise
  // counter-clockwise; empty: none.
  const std::vector<GroundPoint>& walls() const { return walls_; }

  // Volume under the surface between two heights. 0 <= low <= high.
  double volume(double reach, double low_m, double high_m) const;  // m^3
  double volume(double reach) const { return volume(reach, 0, apex_height(reach)); }
  double reach_of_volume(double volume_m3) const;  // at most most_reach()

  double slope() const { return slope_; }  // tan(angle)
  double apex_height(double reach) const { return reach * slope_; }
  // Beyond it the surface would rise over the walls; infinite without walls.
  double most_reach() const { return most_reach_; }
  double to_wall() const { return to_wall_; }  // from the core; infinite without walls
  bool has_walls() const { return !walls_.empty(); }
  // True for a cone without walls.
  bool can_drift() const { return core_.size() == 1 && walls_.empty(); }
  void move_to(const GroundPoint& centre) { core_[0] = centre; }  // only if can_drift()

 private:
  GroundPoint nearest(const GroundPoint& point) const;
  // Integral over reaches from 0 of the area inside the walls within each reach, m^3.
  double area_integral(double reach) const;
  void sample_walls();

  std::vector<GroundPoint> core_;   // 1: point, 2: line, else polygon, counter-clockwise
  std::vector<GroundPoint> walls_;  // counter-clockwise; empty: none
  double slope_;
  double most_reach_, to_wall_;
  double core_area_ = 0, core_perimeter_ = 0;
  // With walls: distances of sample points inside them, ascending, and their running sum.
  std::vector<double> distances_, distance_sums_;
  double sample_area_ = 0;  // m^2 per sample
};

}  // namespace pilesim
