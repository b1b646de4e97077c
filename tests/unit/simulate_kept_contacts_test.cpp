// Contacts that sleepers keep when they change engines.
#include <gtest/gtest.h>

#include "simulate/kept_contacts.h"

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

constexpr auto kAll = [](const BodyContact&) { return true; };

TEST(KeptContacts, StandInPlaceOfThoseOfTheSamePairOnly) {
  KeptContacts kept;
  kept.keep({contact(1, 0, 1), contact(1, 0, 2), contact(2, 1, 3)},
            [](const BodyContact& each) { return each.b == 0; });
  // A pair is the same either way round.
  EXPECT_EQ(distances(kept, {contact(0, 1, 9), contact(2, 1, 8), contact(1, 0, 7)}),
            (std::vector<double>{8, 1, 2}));
}

TEST(KeptContacts, NewOnesReplaceThoseOfTheirPairAndOthersStay) {
  KeptContacts kept;
  kept.keep({contact(1, 0, 1), contact(2, 1, 3)}, kAll);
  kept.keep({contact(2, 1, 4)}, kAll);
  EXPECT_EQ(distances(kept, {}), (std::vector<double>{1, 4}));
}

TEST(KeptContacts, WhatNoLongerHoldsIsForgotten) {
  KeptContacts kept;
  kept.keep({contact(1, 0, 1), contact(2, 1, 3)}, kAll);
  kept.forget([](const BodyContact& each) { return each.a != 2; });
  EXPECT_EQ(distances(kept, {contact(2, 1, 9)}), (std::vector<double>{9, 1}));
  kept.forget([](const BodyContact&) { return false; });
  EXPECT_TRUE(kept.empty());
}

}  // namespace
}  // namespace pilesim
