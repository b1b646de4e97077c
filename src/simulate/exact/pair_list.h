// The pairs of bodies whose boxes meet, kept from step to step.
#pragma once

#include <span>
#include <vector>

#include "simulate/exact/broad_phase.h"
#include "simulate/exact/pair.h"

namespace pilesim::exact {

class PairList {
 public:
  // Both must outlive it.
  PairList(std::span<const CollisionShape> shapes, std::span<const Body> bodies);

  void add(uint32_t body);     // it has come into the world, or may touch others than before
  void remove(uint32_t body);  // with its pairs
  // Finds pairs for what bodies can reach in a step.
  void update(double step_s, double gravity);

  std::span<Pair> pairs() { return pairs_; }  // by Pair::key()
  std::span<const Pair> pairs() const { return pairs_; }

 private:
  bool may_meet(uint32_t a, uint32_t b) const;
  void look_up(std::span<const uint32_t> moved);
  void merge();

  std::span<const CollisionShape> shapes_;
  std::span<const Body> bodies_;
  std::vector<Pair> pairs_;
  std::vector<WideBox> boxes_;  // by body
  std::vector<uint32_t> planes_, fresh_;
  std::vector<uint32_t> present_;  // but planes, ascending
  bool changed_ = false;           // present_ has, since the trees were built
  int steps_ = 0;
  WideTree moving_tree_, fixed_tree_;
  std::vector<uint64_t> found_;  // keys
};

}  // namespace pilesim::exact
