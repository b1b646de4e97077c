// Contacts of sleepers that go from one engine of the mixed mode to the other: the new one finds
// other contacts or, between two that sleep, none.
#pragma once

#include <functional>
#include <vector>

#include "simulate/body_control.h"

namespace pilesim {

class KeptContacts {
 public:
  bool empty() const { return contacts_.empty(); }
  // Of those of `contacts` that `is_wanted` tells, in place of what is kept of the same pairs.
  void keep(const std::vector<BodyContact>& contacts,
            const std::function<bool(const BodyContact&)>& is_wanted);
  // All but those that `holds` tells.
  void forget(const std::function<bool(const BodyContact&)>& holds);
  // Puts what is kept in place of what the engines have of the same pairs.
  void put_into(std::vector<BodyContact>& contacts) const;

 private:
  std::vector<BodyContact> contacts_;  // in the order of pairs
};

}  // namespace pilesim
