// The pairs of bodies whose boxes meet, kept from step to step.
#pragma once

#include <span>
#include <vector>

#include "simulate/exact/state.h"

namespace pilesim::exact {

class PairList {
 public:
  // Works on the boxes and pairs of `state`; both must outlive it.
  PairList(std::span<const CollisionShape> shapes, EngineState& state);

  void add(uint32_t body);     // it has come into the world, or may touch others than before
  void remove(uint32_t body);  // with its pairs
  // Finds pairs for what bodies can reach in a step.
  void update(double step_s, double gravity);
  // Pairs of bodies that no longer stand still are brought back from those that rest. Whether there
  // are any: then pairs have other places.
  bool bring_back();
  // Pairs of bodies that stand still come to rest if there are many; `still`: so many there
  // were when the step's contacts were found.
  void set_aside(size_t still);
  void reload();  // the state is another
  // Count and depth of the contacts of pairs that rest.
  const ContactCount& resting_contacts() const { return resting_contacts_; }

 private:
  bool may_touch(uint32_t a, uint32_t b) const;
  bool renew(uint32_t body, double step_s, double gravity);
  bool is_known(uint32_t i, uint32_t j) const;
  void look_up(std::span<const uint32_t> moved, bool all);
  void merge();
  bool is_still(const Pair& pair) const;
  bool rests(uint32_t body) const { return !rests_.empty() && rests_[body] != 0; }
  void bring_back_if(const auto& comes);
  void make_room(size_t pairs);
  void put_in(std::vector<Pair>& more, std::vector<Pair>& pairs);
  void note_resting();

  std::span<const CollisionShape> shapes_;
  EngineState& state_;
  // Follows from the state.
  std::vector<uint32_t> planes_;
  std::vector<uint32_t> present_;  // but planes, ascending
  bool changed_ = true;            // present_ has, since the trees were built
  int steps_ = 0;
  WideTree moving_tree_, fixed_tree_;
  std::vector<uint8_t> is_moved_;  // bodies whose boxes are new
  std::vector<WideBox> former_;    // and what they were
  std::vector<uint64_t> found_;    // keys of pairs that may be new
  std::vector<Pair> merged_;
  std::vector<uint8_t> rests_;  // (B) whether a body is of a pair that rests
  ContactCount resting_contacts_;
};

}  // namespace pilesim::exact
