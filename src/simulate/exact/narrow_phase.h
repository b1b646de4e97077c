// The contacts of all pairs of a step.
#pragma once

#include <span>
#include <vector>

#include "simulate/exact/state.h"
#include "simulate/exact_engine.h"

namespace pilesim::exact {

class NarrowPhase {
 public:
  // Works on the bodies and pairs of `state`; `active`: the bodies that do not stand still. All and
  // the surroundings must outlive this. `gravity` in m/s^2.
  NarrowPhase(std::span<const CollisionShape> shapes, EngineState& state,
              const std::vector<uint32_t>& active, const Vec3& gravity,
              const ModelSurroundings& surroundings);
  void reload();  // the state is another

  // Finds the contacts of all pairs that `filter` lets touch (empty: all) in a step of `step_s`,
  // and how they bounce. What turns on its way to a contact of this step is moved there.
  void find(double step_s, const PairFilter& filter);

  // When pairs have come or gone since: touching() anew.
  void list_touching();

  // Of the pairs that find() went through, those of bodies that stand still.
  size_t still_pairs() const { return still_pairs_; }
  // As find() has left them: the pairs that have contacts, by their places in the state, ascending.
  std::span<const uint32_t> touching() const { return touching_; }
  // And of each body the part of the step that it has made already, s.
  std::span<const double> ahead_s() const { return ahead_s_; }

 private:
  // What is found of some pairs that follow each other.
  struct Part {
    std::vector<uint32_t> touching;
    std::vector<Contact> contacts;
    size_t still = 0;       // pairs of bodies that stand still
    bool is_ahead = false;  // some contacts are of a later time than the step's begin
  };
  void find_part(size_t begin, size_t end, const PairFilter& filter, Part& part);
  void find_again(size_t begin, size_t end, const PairFilter& filter, Part& part);
  bool is_to_be_looked_at(Pair& pair, const PairFilter& filter) const;
  void look_at(uint32_t index, bool anew, std::span<const Contact> former, Part& part);
  bool advance(std::span<const Part> parts);
  void list(std::span<const Part> parts);
  void place_bodies();
  void place(uint32_t body);
  Stir still(uint32_t body) const;
  const Placed& placed(uint32_t body, Placed& own) const;
  void bounce(const Placed& a, const Placed& b, std::span<Contact> contacts) const;
  const CollisionShape& shape_of(uint32_t body) const { return shapes_[bodies_[body].shape]; }

  std::span<const CollisionShape> shapes_;
  EngineState& state_;
  std::vector<Body>& bodies_;
  const std::vector<uint32_t>& active_;
  NarrowSettings settings_;
  Vec3 gravity_;
  // Scratch of a step.
  std::vector<Placed> placed_;  // but for what stands still
  std::vector<Stir> stirs_;
  std::vector<uint32_t> stirring_;  // bodies that did not stand still when they were made
  std::vector<double> ahead_s_;
  std::vector<uint32_t> touching_;
  size_t still_pairs_ = 0;
  std::vector<Part> parts_;
};

}  // namespace pilesim::exact
