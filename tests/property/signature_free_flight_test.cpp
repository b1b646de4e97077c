// The search for the first contact against a dense march in plain double arithmetic. Tolerances are
// relative to the body and cover the Taylor series over flights of tens of radians.
#include "signature/trial/free_flight.h"

#include <gtest/gtest.h>

#include "support/signature_bodies.h"

namespace pilesim {
namespace {

using test::SlowFlight;

class FirstContact : public testing::TestWithParam<int> {};

TEST_P(FirstContact, AgreesWithADenseMarch) {
  Philox random(7, Stream::test, static_cast<uint64_t>(GetParam()));
  const ContactBody body = test::random_body(random, 4 + 12 * GetParam());
  for (int trial = 0; trial < 40; ++trial) {
    const Flight start = test::random_flight(body, random, 8);
    const test::FlightResult result = test::fly_one(body, start);
    ASSERT_EQ(result.end, FlightEnd::contact);
    // The march must stay clear of the plane until just before the contact: none was missed.
    SlowFlight slow(body, start);
    // At most 0.005 rad per step.
    const int steps = 100 + static_cast<int>(200 * result.flight.time_s * start.spin.norm() * 2);
    const double size = body.outer_radius_m;
    for (int i = 0; i < steps; ++i) {
      ASSERT_GE(slow.gap(), -1e-7 * size) << "trial " << trial << " at " << i << " of " << steps;
      slow.advance(result.flight.time_s / steps);
    }
    // It must touch the plane there, with the same position, orientation and spin.
    EXPECT_NEAR(slow.gap(), 0, 1e-7 * size);
    EXPECT_NEAR(slow.height(), result.flight.height, 1e-7 * size);
    EXPECT_NEAR(slow.height() + slow.rotation().row(1).dot(body.vertices[result.vertex]), 0,
                1e-7 * size);
    EXPECT_LT((slow.world_spin() - result.flight.world_spin()).norm(),
              1e-6 * (1 / size + slow.world_spin().norm()));
    EXPECT_LT((slow.rotation() - result.flight.orientation().toRotationMatrix()).norm(), 1e-6);
  }
}

INSTANTIATE_TEST_SUITE_P(Bodies, FirstContact, testing::Range(0, 6));

}  // namespace
}  // namespace pilesim
