// Static things that lie against each other are one surface: what they cover of one another gives
// no normals. "Static" are bodies that never move and never leave; the pieces of a kinematic body
// are so to each other.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "geometry/box_tree.h"
#include "model/model.h"
#include "simulate/exact/collision_shape.h"

namespace pilesim::exact {

// Things that never move against each other.
class Surroundings {
 public:
  struct Thing {
    Vec3 position;  // m, in the frame of all
    Mat3 turn;      // to that frame
    const CollisionShape* shape;
  };
  explicit Surroundings(std::vector<Thing> things);

  // Whether something lies against that piece of the thing (of a surface: its triangle).
  bool is_beside(uint32_t thing, uint32_t piece) const {
    const std::vector<uint8_t>& marks = marks_of(thing);
    return !marks.empty() && marks[piece] != 0;
  }
  // Whether something may lie against it.
  bool is_beside(uint32_t thing) const {
    return !beside_[thing].empty() || on_surfaces_[thing] != nullptr;
  }

  // The body that meets the piece, in the thing's frame: the least of direction . x over it, m.
  using Lowest = std::function<double(const Vec3& direction)>;

  // The piece is to push a body away along `normal`, unit and outward, from its point `point`, in
  // the thing's frame; a triangle from the `side` (1 or -1) of its normal. Where something else
  // lies there the normal must leave that, too: the nearest that does, or zero, where the point is
  // covered and the body is not to be pushed by this piece. `small_m` is the extent by which the
  // contact is measured.
  Vec3 outward(uint32_t thing, uint32_t piece, int side, const Vec3& point, const Vec3& normal,
               double small_m, const Lowest& lowest) const;

 private:
  class Search;
  struct Item {
    uint32_t thing, piece;
  };
  // Made when it is first asked for, as the surface is.
  struct SurfaceMarks {
    std::vector<Bounds> near;  // what may lie against it, in its frame
    std::once_flag once;
    std::vector<uint8_t> triangles;
  };
  Bounds box_of(const Thing& thing, uint32_t piece) const;
  const std::vector<uint8_t>& marks_of(uint32_t thing) const;

  std::vector<Thing> things_;
  std::vector<uint32_t> planes_;
  std::vector<Item> items_;
  BoxTree tree_;
  std::vector<std::vector<uint8_t>> beside_;                // by thing and piece; empty: nothing is
  std::vector<std::unique_ptr<SurfaceMarks>> on_surfaces_;  // by thing; null: nothing is
};

// Those of a model, by body.
class ModelSurroundings {
 public:
  // `model` and `shapes` must outlive it.
  ModelSurroundings(const Model& model, std::span<const CollisionShape> shapes);
  struct Place {
    const Surroundings* all = nullptr;  // null: nothing lies against the body
    uint32_t thing = 0;
  };
  Place of(uint32_t body) const { return body < places_.size() ? places_[body] : Place{}; }

 private:
  std::vector<std::unique_ptr<Surroundings>> groups_;
  std::vector<Place> places_;
};

}  // namespace pilesim::exact
