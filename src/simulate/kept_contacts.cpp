#include "simulate/kept_contacts.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace pilesim {
namespace {

std::pair<uint32_t, uint32_t> pair_of(const BodyContact& contact) {
  return std::minmax(contact.a, contact.b);
}

}  // namespace

void KeptContacts::keep(const std::vector<BodyContact>& contacts,
                        const std::function<bool(const BodyContact&)>& is_wanted) {
  KeptContacts added;
  std::ranges::copy_if(contacts, std::back_inserter(added.contacts_), is_wanted);
  std::ranges::stable_sort(added.contacts_, {}, pair_of);
  added.put_into(contacts_);
  std::ranges::stable_sort(contacts_, {}, pair_of);
}

void KeptContacts::forget(const std::function<bool(const BodyContact&)>& holds) {
  std::erase_if(contacts_, [&](const BodyContact& contact) { return !holds(contact); });
}

void KeptContacts::put_into(std::vector<BodyContact>& contacts) const {
  if (empty()) return;
  std::erase_if(contacts, [&](const BodyContact& contact) {
    return std::ranges::binary_search(contacts_, pair_of(contact), {}, pair_of);
  });
  contacts.insert(contacts.end(), contacts_.begin(), contacts_.end());
}

}  // namespace pilesim
