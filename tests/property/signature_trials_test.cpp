// Trials of random bodies with random materials.
#include <gtest/gtest.h>

#include "signature/trial/contact_impulse.h"
#include "signature/trial/contact_sampler.h"
#include "signature/trial/flight_reach.h"
#include "support/random_vectors.h"
#include "support/signature_bodies.h"

namespace pilesim {
namespace {

TrialRequest random_request(const ContactBody& body, Philox& random, uint64_t object) {
  TrialRequest request;
  request.velocity = test::random_in_box(random, {-3, -3, -3}, {3, -0.05, 3});
  request.spin = test::random_arrow(random, 0, 4) / body.gyration_m;
  request.start = TrialStart::launch;
  request.object = object;
  request.count = 100;
  return request;
}

class Trials : public testing::TestWithParam<int> {
 protected:
  Philox random{5, Stream::test, static_cast<uint64_t>(GetParam())};
  ContactBody body = test::random_body(random, 4 + 6 * GetParam());
};

// Per unit of mass, J/kg.
double kinetic_energy(const ContactBody& body, const Flight& flight) {
  return 0.5 * (flight.velocity.squaredNorm() +
                body.inertia_m2.dot(flight.spin.cwiseProduct(flight.spin)));
}

// Energies from the inertia in world axes would need the final orientation; check the impulse
// itself instead.
TEST_P(Trials, ImpulsesKeepEnergyRestitutionAndCoulombsLimit) {
  for (int i = 0; i < 4000; ++i) {
    const ContactMaterial material{.restitution = random.uniform(),
                                   .friction = random.uniform(0, 2)};
    Flight flight = test::random_flight(body, random, 6);
    const uint32_t vertex = lowest_vertex(body, flight.normal).vertex;
    const double before = kinetic_energy(body, flight);
    const Vec3 velocity = flight.velocity;
    const double approach = apply_contact_impulse(body, material, vertex, flight);
    EXPECT_LE(kinetic_energy(body, flight), before * (1 + 1e-12));
    if (approach <= 0) continue;
    // Coulomb's limit, per unit of mass.
    const Vec3 impulse = flight.velocity - velocity;
    EXPECT_GT(impulse.y(), 0);
    EXPECT_LE(std::hypot(impulse.x(), impulse.z()),
              material.friction * impulse.y() * (1 + 1e-9) + 1e-12);
    const Vec3 u = flight.to_body(flight.velocity) + flight.spin.cross(body.vertices[vertex]);
    EXPECT_NEAR(flight.normal.dot(u), material.restitution * approach, 1e-9 * (1 + approach));
  }
}

TEST_P(Trials, BodiesLeaveThePlaneInTheEnd) {
  const TrialSetup setup{&body, {.restitution = 0.3, .friction = 0.5}, TrialKind::macro, 1};
  std::vector<TrialResult> results;
  for (uint64_t i = 0; i < 10; ++i) {
    const TrialRequest request = random_request(body, random, i);
    run_trials(setup, std::span(&request, 1), results);
    for (const TrialResult& result : results) {
      EXPECT_TRUE(result.kept);
      EXPECT_FALSE(result.unsettled);
      EXPECT_GE(result.impacts, 1);
      EXPECT_GE(result.velocity.y(), 0);
      EXPECT_GT(result.height_m, 0);
      EXPECT_LE(result.height_m, body.outer_radius_m);
    }
  }
}

// Without friction and with full restitution energy is conserved, and the spin by energy determines
// all of it, however different the moments are.
TEST_P(Trials, SpinsOfEqualEnergyTellTheEnergy) {
  TrialSetup setup{&body, {.restitution = 1, .friction = 0}, TrialKind::macro, 1};
  setup.spins = SpinMeasure::energy;
  const auto energy = [&](const Vec3& velocity, const Vec3& spin) {
    return velocity.squaredNorm() + std::pow(body.gyration_m, 2) * spin.squaredNorm();
  };
  std::vector<TrialResult> results;
  for (uint64_t i = 0; i < 10; ++i) {
    const TrialRequest request = random_request(body, random, i);
    run_trials(setup, std::span(&request, 1), results);
    for (const TrialResult& result : results) {
      if (!result.kept) continue;
      const double before = energy(request.velocity, result.spin_before);
      EXPECT_NEAR(energy(result.velocity, result.spin), before, 1e-6 * before);
    }
  }
}

// Powers of two scale doubles without rounding.
TEST_P(Trials, AreHomogeneousBitForBit) {
  for (const TrialKind kind : {TrialKind::micro, TrialKind::macro}) {
    const TrialSetup setup{&body, {.restitution = 0.4, .friction = 0.6}, kind, 1};
    TrialRequest request = random_request(body, random, 3);
    std::vector<TrialResult> slow, fast;
    run_trials(setup, std::span(&request, 1), slow);
    request.velocity *= 1024;
    request.spin *= 1024;
    run_trials(setup, std::span(&request, 1), fast);
    for (size_t i = 0; i < slow.size(); ++i) {
      EXPECT_EQ(fast[i].velocity, 1024 * slow[i].velocity) << i;
      EXPECT_EQ(fast[i].spin, 1024 * slow[i].spin) << i;
      EXPECT_EQ(fast[i].height_m, slow[i].height_m);
      EXPECT_EQ(fast[i].impacts, slow[i].impacts);
    }
  }
}

// Lowest reach of vertices when a flight's momentum points along `direction` in the body, at an
// angle with that `cosine` to the downward normal: each vertex may enter their plane.
double lowest_about(const ContactBody& body, const Vec3& direction, double cosine) {
  const double sine = std::sqrt(std::max(0.0, 1 - cosine * cosine));
  double lowest = 0;
  for (const Vec3& v : body.vertices) {
    lowest = std::max(lowest, v.dot(direction) * cosine + v.cross(direction).norm() * sine);
  }
  return lowest;
}

// No vertex reaches above the bound in a slow march over many turns. A longer march cannot differ:
// vertices turn about the momentum, and it circles its polhode.
TEST_P(Trials, NoVertexReachesBelowTheReachOfItsFlight) {
  for (int i = 0; i < 10; ++i) {
    const Flight flight = test::random_flight(body, random, 1);
    const double reach = reach_of_flight(body, flight.normal, flight.spin);
    EXPECT_LE(reach, body.outer_radius_m);
    test::SlowFlight slow(body, flight);
    const Vec3 in_body = body.inertia_m2.cwiseProduct(flight.spin).normalized();
    const Vec3 momentum = slow.rotation() * in_body;
    const double step_s = 0.05 / flight.spin.norm();
    double deepest = 0;
    for (int k = 0; k < 2000; ++k, slow.advance(step_s)) {
      deepest = std::max(deepest, slow.height() - slow.gap());
      const Vec3 direction = slow.rotation().transpose() * momentum;
      deepest = std::max(deepest, lowest_about(body, direction, -momentum.y()));
    }
    EXPECT_LE(deepest, reach * (1 + 1e-4));
  }
}

// A body turns for ever about the axes of the largest and the smallest moment, and within a turn
// each vertex reaches its lowest point: there the bound is exact.
TEST_P(Trials, TheReachOfAFlightAboutAPrincipalAxisIsAttained) {
  constexpr double kStep = 0.05;  // rad
  for (const int axis : {0, 2}) {
    Flight flight = test::random_flight(body, random, 1);
    flight.spin = Vec3::Unit(axis) * (random.uniform() < 0.5 ? -1 : 1);
    const double reach = reach_of_flight(body, flight.normal, flight.spin);
    test::SlowFlight slow(body, flight);
    double deepest = 0;
    for (double angle = 0; angle < 2 * kPi; angle += kStep, slow.advance(kStep)) {
      deepest = std::max(deepest, slow.height() - slow.gap());
    }
    // Between two steps a vertex descends by the height of an arc; the search is in float.
    const double between = 1 - std::cos(kStep / 2);
    EXPECT_NEAR(deepest, reach, (between + 3e-5) * body.outer_radius_m) << "axis " << axis;
  }
}

// A wheel on a thin axle turns about the axis of its largest moment, and reaches farthest along it.
TEST(FlightReach, OfAWheelIsItsAxles) {
  std::vector<Vec3> points = {{0, 0, 2}, {0, 0, -2}};
  for (int i = 0; i < 12; ++i) {
    points.push_back({std::cos(i * kPi / 6), std::sin(i * kPi / 6), 0});
  }
  const ContactBody wheel =
      make_contact_body(convex_hull(points), Vec3(0.25, 0.25, 0.5).asDiagonal());
  for (const double tilt : {0.0, 0.3, 1.2}) {
    const Vec3 down(std::sin(tilt), 0, -std::cos(tilt));
    const double truth = std::max(2 * std::cos(tilt), std::sin(tilt));
    EXPECT_NEAR(reach_of_flight(wheel, -down, Vec3(0, 0, 3)), truth, 1e-4) << tilt;
  }
}

INSTANTIATE_TEST_SUITE_P(Bodies, Trials, testing::Range(0, 6));

}  // namespace
}  // namespace pilesim
