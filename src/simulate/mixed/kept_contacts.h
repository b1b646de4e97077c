// Contacts of sleeping bodies that change between the engines of the mixed mode, or their level:
// afterwards other contacts would be found or, between two sleepers, none.
#pragma once

#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include "simulate/body_control.h"

namespace pilesim {

class KeptContacts {
 public:
  // Symmetric in its arguments.
  using PairTest = std::function<bool(uint32_t a, uint32_t b)>;

  // Contacts `before` and `after` the change: for pairs accepted by `is_wanted`, those before it
  // count.
  void keep(const std::vector<BodyContact>& before, const std::vector<BodyContact>& after,
            const PairTest& is_wanted);
  // Drops all pairs except those accepted by `holds`.
  void forget(const PairTest& holds);
  // Replaces the engines' contacts of the same pairs.
  void put_into(std::vector<BodyContact>& contacts) const;

  static void fields(auto& self, auto& stream) { stream(self.contacts_, self.apart_); }
  // After loading: true if all bodies are below `count`.
  bool is_of(size_t count) const;

 private:
  using Pair = std::pair<uint32_t, uint32_t>;
  static Pair pair_of(const BodyContact& contact) { return std::minmax(contact.a, contact.b); }
  bool has(const Pair& pair) const;

  std::vector<BodyContact> contacts_;  // ordered by pair
  std::vector<Pair> apart_;            // pairs that only seem to touch since the change; ascending
};

}  // namespace pilesim
