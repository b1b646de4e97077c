// Contacts of sleepers that change engines.
#include <gtest/gtest.h>

#include "simulate/mixed/kept_contacts.h"

namespace pilesim {
namespace {

BodyContact contact(uint32_t a, uint32_t b, double distance_m) {
  return {.a = a, .b = b, .point = Vec3::Zero(), .normal = Vec3::UnitY(), .distance_m = distance_m};
}

std::vector<double> distances(const KeptContacts& kept, std::vector<BodyContact> contacts) {
  kept.put_into(contacts);
  std::vector<double> result;
  for (const BodyContact& each : contacts) result.push_back(each.distance_m);
  return result;
}

constexpr auto kAll = [](uint32_t, uint32_t) { return true; };

TEST(KeptContacts, StandInPlaceOfThoseOfTheSamePairOnly) {
  KeptContacts kept;
  kept.keep({contact(1, 0, 1), contact(1, 0, 2), contact(2, 1, 3)}, {},
            [](uint32_t, uint32_t b) { return b == 0; });
  // A pair is the same in either order.
  EXPECT_EQ(distances(kept, {contact(0, 1, 9), contact(2, 1, 8), contact(1, 0, 7)}),
            (std::vector<double>{8, 1, 2}));
}

TEST(KeptContacts, SeparatePairsStaySeparate) {
  KeptContacts kept;
  kept.keep({contact(1, 0, 1)}, {contact(2, 1, 3), contact(1, 0, 5), contact(3, 1, 4)},
            [](uint32_t a, uint32_t) { return a != 3; });
  EXPECT_EQ(distances(kept, {contact(1, 2, 9), contact(3, 1, 7)}), (std::vector<double>{7, 1}));
}

TEST(KeptContacts, AnotherChangeAddsPairsAndKeepsTheFirst) {
  KeptContacts kept;
  kept.keep({contact(1, 0, 1)}, {contact(2, 0, 2)}, kAll);
  kept.keep({contact(1, 0, 3), contact(2, 0, 4), contact(2, 1, 5)}, {contact(1, 0, 6)}, kAll);
  EXPECT_EQ(distances(kept, {contact(2, 0, 9)}), (std::vector<double>{1, 5}));
}

TEST(KeptContacts, InvalidContactsAreForgotten) {
  KeptContacts kept;
  kept.keep({contact(1, 0, 1), contact(2, 1, 3)}, {contact(2, 0, 4)}, kAll);
  kept.forget([](uint32_t a, uint32_t b) { return a != 2 && b != 2; });
  EXPECT_EQ(distances(kept, {contact(2, 1, 9), contact(2, 0, 8)}), (std::vector<double>{9, 8, 1}));
}

}  // namespace
}  // namespace pilesim
