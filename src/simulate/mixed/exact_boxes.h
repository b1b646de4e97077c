// The boxes of must-impulse bodies, and the bodies that touch them (dissertation 4.2.2). A body of
// several convex pieces has a box for each: a body beside a pole does not touch it for the sake of
// the pole's foot.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "geometry/hull_faces.h"
#include "model/model.h"
#include "simulate/exact_engine.h"
#include "simulate/mixed/mixed_constants.h"
#include "simulate/sphere/dispatch_table.h"

namespace pilesim {

class ExactBoxes {
 public:
  // All arguments must outlive it. `by_pieces`: a body of several convex pieces has a box for each,
  // otherwise one (dissertation 4.2.2).
  ExactBoxes(const Model& model, const DispatchTable& dispatch, const ExactEngine& world,
             bool by_pieces);

  // A must-impulse body has come into the world or left it.
  void add(uint32_t body);
  void remove(uint32_t body);
  // Before each step: boxes of moving bodies, with the motion of the step in them.
  void update();

  // A body that may touch some box.
  struct Candidate {
    uint32_t body;
    Pose pose;
    double radius_m;   // outer
    double margin_m;   // by which its own box is wider
    bool only_moving;  // asks for boxes that may have come nearer to a body that does not move
  };
  // False where touches() is for all that lies within `reach_m`; fast. Any thread.
  bool may_touch(const Vec3& centre, double reach_m, bool only_moving) const;
  // Whether its box touches one of a body whose pairs with it are solved. Any thread.
  bool touches(const Candidate& candidate) const;
  // The largest momentum, N s, that may hit a sleeping body in this step: from bodies with such
  // boxes that are faster than `least_speed`. Infinite for bodies moved by keys.
  double blow_ns(const Candidate& candidate, double least_speed) const;
  // Whether such a box reaches into the hull of a body that has several pieces, as seen from its
  // centre: it goes through a ring, or into a cup. Any thread.
  bool reach_into(uint32_t body, const Pose& pose) const;
  bool empty() const { return boxes_.empty(); }

  // The boxes as of the last update().
  void save(StateWriter& writer) const { writer(boxes_); }
  void load(StateReader& reader);

 private:
  struct Box {
    uint32_t body = 0;
    bool is_plane = false, moves = false;
    Bounds bounds;                                     // but for planes
    std::vector<Bounds> pieces;                        // and of its convex pieces, or the same
    Vec3 normal = Vec3::Zero(), point = Vec3::Zero();  // of a plane

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
  std::vector<std::vector<HullFace>> hulls_;  // by shape, of those that may be threaded
  std::vector<Box> boxes_;                    // in the order of bodies
  // Seen from above, a raster over all boxes: whether there is one in a cell, and one that moves.
  // Most bodies are far from all boxes.
  static constexpr uint8_t kBoxThere = 1, kMovingThere = 2;
  std::array<uint8_t, size_t{mixed_constants::kCells} * mixed_constants::kCells> map_{};
  bool has_plane_ = false;
  Vec3 map_origin_ = Vec3::Zero();
  Vec3 cells_per_m_ = Vec3::Zero();
};

}  // namespace pilesim
