#include "simulate/mixed/kept_contacts.h"

#include <algorithm>
#include <iterator>

namespace pilesim {

bool KeptContacts::has(const Pair& pair) const {
  return std::ranges::binary_search(contacts_, pair, {}, pair_of) ||
         std::ranges::binary_search(apart_, pair);
}

bool KeptContacts::is_of(size_t count) const {
  return std::ranges::all_of(contacts_,
                             [&](const BodyContact& c) { return c.a < count && c.b < count; }) &&
         std::ranges::all_of(
             apart_, [&](const Pair& pair) { return pair.first < count && pair.second < count; });
}

void KeptContacts::keep(const std::vector<BodyContact>& before,
                        const std::vector<BodyContact>& after, const PairTest& is_wanted) {
  const auto wanted = [&](const BodyContact& contact) { return is_wanted(contact.a, contact.b); };
  const KeptContacts old = *this;
  std::ranges::copy_if(before, std::back_inserter(contacts_), [&](const BodyContact& contact) {
    return wanted(contact) && !old.has(pair_of(contact));
  });
  std::ranges::stable_sort(contacts_, {}, pair_of);
  std::vector<Pair> seeming;
  for (const BodyContact& contact : after) {
    if (wanted(contact) && !has(pair_of(contact))) seeming.push_back(pair_of(contact));
  }
  apart_.insert(apart_.end(), seeming.begin(), seeming.end());
  std::ranges::sort(apart_);
}

void KeptContacts::forget(const PairTest& holds) {
  std::erase_if(contacts_,
                [&](const BodyContact& contact) { return !holds(contact.a, contact.b); });
  std::erase_if(apart_, [&](const Pair& pair) { return !holds(pair.first, pair.second); });
}

void KeptContacts::put_into(std::vector<BodyContact>& contacts) const {
  if (contacts_.empty() && apart_.empty()) return;
  std::erase_if(contacts, [&](const BodyContact& contact) { return has(pair_of(contact)); });
  contacts.insert(contacts.end(), contacts_.begin(), contacts_.end());
}

}  // namespace pilesim
