// Bodies of one kind that are poured onto a plane, or into a column of walls, in any mode: what of
// them comes to rest says how the object packs. Rigid bodies under friction have no scale of their
// own, so lengths are told in R, the radius of the ball that holds the object, and times in
// sqrt(R / g).
#pragma once

#include <cstdint>
#include <vector>

#include "model/model.h"
#include "scene/scene.h"
#include "simulate/simulator.h"

namespace pilesim {

struct PouredObject {
  ModelShape shape;           // with pieces, by which it collides where it is solved
  Material material;          // of it, of the ground and of the walls
  double outer_radius_m = 0;  // R
  double volume_m3 = 0;
};

enum class PourKind { heap, large_heap, column, alone };

struct PourFigures {
  double height = 0;  // R, the mean of the centres above the ground
  double spread = 0;  // R, their mean distance from the axis
  double reach = 0;   // R, how far they reach below their centres in the mean
  // A column's solid share, away from its ends and walls, and that of its lower half; distance from
  // a centre to the nearest other one, R. 0 where it is too low to say.
  double fraction = 0, deep_fraction = 0, nearest = 0;
  double time = 0;  // sqrt(R / g), until it is at rest
  // Distance from release to rest of a body alone, R, dropped and thrown.
  double dropped = 0, thrown = 0;
};

class PourTrial {
 public:
  PourTrial(const PouredObject& object, PourKind kind);

  const Scene& scene() const { return scene_; }  // of the impulse mode
  // A model with new starts of its bodies, keyed by the seed.
  Model starts(uint64_t seed) const;
  // Steps a simulator of such a model until it is at rest, or the time is up.
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
  std::vector<Vec3> places_;      // m, at which they start
  std::vector<Vec3> corners_;     // R, of the object's convex hull, body frame
};

}  // namespace pilesim
