// Contacts of sleepers that go from one engine of the mixed mode to the other, or to another level:
// from then on other contacts would be found or, between two that sleep, none.
#pragma once

#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include "simulate/body_control.h"

namespace pilesim {

class KeptContacts {
 public:
  // Either way round.
  using PairTest = std::function<bool(uint32_t a, uint32_t b)>;

  // `before` and `after` the change: of the pairs that `is_wanted` tells, those before it count.
  void keep(const std::vector<BodyContact>& before, const std::vector<BodyContact>& after,
            const PairTest& is_wanted);
  // All pairs but those that `holds` tells.
  void forget(const PairTest& holds);
  // Puts kept contacts in place of those of the engines for the same pairs.
  void put_into(std::vector<BodyContact>& contacts) const;

  static void fields(auto& self, auto& stream) { stream(self.contacts_, self.apart_); }
  // After loading: whether all bodies are below `count`.
  bool is_of(size_t count) const;

 private:
  using Pair = std::pair<uint32_t, uint32_t>;
  static Pair pair_of(const BodyContact& contact) { return std::minmax(contact.a, contact.b); }
  bool has(const Pair& pair) const;

  std::vector<BodyContact> contacts_;  // in the order of pairs
  std::vector<Pair> apart_;            // that only seem to touch since the change; ascending
};

}  // namespace pilesim
