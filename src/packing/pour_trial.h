// Pours bodies of one kind onto a plane or into a column with walls, in any mode; the figures of
// the resting pile describe how the object packs. Rigid bodies under friction have no scale of
// their own. Lengths are therefore in R, the object's bounding radius, and times in sqrt(R / g).
#pragma once

#include <cstdint>
#include <vector>

#include "model/model.h"
#include "scene/scene.h"
#include "simulate/simulator.h"

namespace pilesim {

struct PouredObject {
  ModelShape shape;           // with the convex pieces that the exact engine uses
  Material material;          // of the object, the ground and the walls
  double outer_radius_m = 0;  // R
  double volume_m3 = 0;
};

enum class PourKind { heap, large_heap, column, alone };

struct PourFigures {
  double height = 0;  // R, mean height of the centres above the ground
  double spread = 0;  // R, mean distance of the centres from the axis
  double reach = 0;   // R, mean reach of bodies below their centres
  // Solid share of a column away from its ends and walls, and of its lower half, and distance (R)
  // from a centre to its nearest neighbour. 0 where the column is too low to tell.
  double fraction = 0, deep_fraction = 0, nearest = 0;
  double time = 0;  // sqrt(R / g), time until rest
  // R, distance between release and rest of a single body, dropped and thrown.
  double dropped = 0, thrown = 0;
};

class PourTrial {
 public:
  PourTrial(const PouredObject& object, PourKind kind);

  const Scene& scene() const { return scene_; }  // of the impulse mode
  // A model with starting positions that depend on `seed`.
  Model starts(uint64_t seed) const;
  // Steps a simulator of such a model until it is at rest or the time is over.
  PourFigures run(Simulator& simulator) const;

 private:
  bool is_thrown(size_t body) const;
  double reach_below(const Quat& orientation) const;  // R
  void judge_ways(const std::vector<Vec3>& positions, PourFigures& figures) const;
  void judge_bulk(const std::vector<Vec3>& places, PourFigures& figures) const;

  Scene scene_;
  double volume_m3_, radius_m_, time_s_;
  PourKind kind_;
  double half_width_ = 0;  // R, of the column
  Model model_;
  std::vector<uint32_t> poured_;  // bodies
  std::vector<Vec3> places_;      // m, starting positions
  std::vector<Vec3> corners_;     // R, of the object's convex hull, body frame
};

}  // namespace pilesim
