// The boxes of must-impulse bodies, and the bodies that touch them (dissertation 4.2.2). A body of
// several convex pieces has one box per piece: a wide foot must not enlarge the box of its pole.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "model/model.h"
#include "simulate/exact_engine.h"
#include "simulate/mixed/mixed_constants.h"
#include "simulate/sphere/dispatch_table.h"

namespace pilesim {

class ExactBoxes {
 public:
  // All arguments must outlive it. `by_pieces`: one box per convex piece; otherwise one per body
  // (dissertation 4.2.2).
  ExactBoxes(const Model& model, const DispatchTable& dispatch, const ExactEngine& world,
             bool by_pieces);

  // Call them when a must-impulse body enters or leaves the world.
  void add(uint32_t body);
  void remove(uint32_t body);
  // Before each step: updates boxes of moving bodies, enlarged by the motion of the step.
  void update();

  // A body to test against the boxes.
  struct Candidate {
    uint32_t body;
    Pose pose;
    double radius_m;   // bounding radius
    double margin_m;   // enlarges its own box
    bool only_moving;  // only test boxes that may have approached a body at rest
  };
  // False only if touches() is false for all bodies within `reach_m`; fast. Thread-safe.
  bool may_touch(const Vec3& centre, double reach_m, bool only_moving) const;
  // True if its box touches that of a body whose pairs with it are solved. Thread-safe.
  bool touches(const Candidate& candidate) const;
  // The most momentum, N s, that an impact may give a sleeping body in this step, from bodies with
  // such boxes that are faster than `least_speed`, m/s. Infinite for kinematic bodies.
  double impulse_bound_ns(const Candidate& candidate, double least_speed) const;
  bool empty() const { return boxes_.empty(); }

  // The boxes as of the last update().
  void save(StateWriter& writer) const { writer(boxes_); }
  void load(StateReader& reader);

 private:
  struct Box {
    uint32_t body = 0;
    bool is_plane = false, moves = false;
    Bounds bounds;               // undefined for planes
    std::vector<Bounds> pieces;  // and those of its convex pieces, or the same
    Vec3 normal = Vec3::Zero(), point = Vec3::Zero();  // for planes

    static void fields(auto& self, auto& stream) {
      stream(self.body, self.is_plane, self.moves, self.bounds, self.pieces, self.normal,
             self.point);
    }
  };
  void measure(Box& box) const;
  void map_boxes();
  std::array<int, 2> cell_of(const Vec3& point) const;
  bool near(const Box& box, const Candidate& candidate) const;

  const Model& model_;
  const DispatchTable& dispatch_;
  const ExactEngine& world_;
  bool by_pieces_;
  std::vector<Box> boxes_;  // in the order of bodies
  // A raster over all boxes seen from above: whether a cell contains a box, or a moving one. Most
  // bodies are far from all boxes.
  static constexpr uint8_t kBoxThere = 1, kMovingThere = 2;
  std::array<uint8_t, size_t{mixed_constants::kCells} * mixed_constants::kCells> map_{};
  bool has_plane_ = false;
  Vec3 map_origin_ = Vec3::Zero();
  Vec3 cells_per_m_ = Vec3::Zero();
};

}  // namespace pilesim
