// The contacts of all pairs of a step.
#pragma once

#include <span>
#include <vector>

#include "simulate/exact/state.h"
#include "simulate/exact/throws.h"
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
  // and how they bounce. Bodies that turn on their way to a contact of this step are moved there.
  void find(double step_s, const PairFilter& filter);

  // Lists touching() again, when pairs have come or gone since.
  void list_touching();
  // Adds contacts of pairs that have none yet, with bodies that impacts of this step may throw at
  // others.
  void find_thrown(const PairFilter& filter);
  const Throws& throws() const { return throws_; }

  // The number of pairs of bodies that stand still, in the last find().
  size_t still_pairs() const { return still_pairs_; }
  // As find() has left them: the pairs that have contacts, by their places in the state, ascending.
  std::span<const uint32_t> touching() const { return touching_; }
  // And of each body the part of the step that it has made already, s.
  std::span<const double> advanced_s() const { return advanced_s_; }

 private:
  // The result for some pairs that follow each other.
  struct Part {
    std::vector<uint32_t> touching;
    std::vector<Contact> contacts;
    size_t still = 0;          // pairs of bodies that stand still
    bool is_advanced = false;  // some contacts are of a later time than the step's begin
  };
  void find_part(size_t begin, size_t end, const PairFilter& filter, Part& part);
  void find_again(size_t begin, size_t end, const PairFilter& filter, Part& part);
  bool is_to_be_tested(Pair& pair, const PairFilter& filter) const;
  void update(uint32_t index, bool is_tested, std::span<const Contact> former, Part& part);
  bool advance(std::span<const Part> parts);
  void list(std::span<const Part> parts);
  void pose_bodies();
  void pose(uint32_t body);
  MotionBound still(uint32_t body) const;
  const PosedBody& posed(uint32_t body, PosedBody& own) const;
  void find_thrown(Pair& pair, std::vector<Contact>& contacts) const;
  void bounce(const PosedBody& a, const PosedBody& b, double advanced_s,
              std::span<Contact> contacts) const;
  static void close_gap(const PosedBody& a, const PosedBody& b, std::span<Contact> contacts);
  const CollisionShape& shape_of(uint32_t body) const { return shapes_[bodies_[body].shape]; }

  std::span<const CollisionShape> shapes_;
  EngineState& state_;
  std::vector<Body>& bodies_;
  const std::vector<uint32_t>& active_;
  NarrowSettings settings_;
  Vec3 gravity_;
  // Scratch of a step.
  std::vector<PosedBody> posed_;  // but for what stands still
  std::vector<MotionBound> motion_bounds_;
  std::vector<uint32_t> moving_before_;  // bodies that did not stand still when they were made
  std::vector<double> advanced_s_;
  std::vector<uint32_t> touching_;
  size_t still_pairs_ = 0;
  std::vector<Part> parts_;
  Throws throws_;
};

}  // namespace pilesim::exact
