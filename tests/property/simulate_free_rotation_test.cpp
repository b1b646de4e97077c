// Freely rotating bodies, against closed forms and a slower method.
#include "simulate/free_rotation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/philox.h"
#include "support/random_vectors.h"

namespace pilesim {
namespace {

struct Turning {
  Vec3 moments = Vec3::Ones();
  Quat axes = Quat::Identity();
  Quat orientation = Quat::Identity();
  Vec3 spin = Vec3::Zero();

  void step(double step_s) { rotate_freely(moments, axes, step_s, orientation, spin); }
  Quat principal() const { return orientation * axes; }
  Vec3 momentum() const {
    return principal() * moments.cwiseProduct(principal().conjugate() * spin);
  }
  double energy() const { return spin.dot(momentum()) / 2; }
};

Quat any_turn(Philox& random) {
  const double angle = random.uniform(0, 2 * kPi);
  return Quat(Eigen::AngleAxisd(angle, random.direction()));
}

// Principal moments of a solid: none exceeds the sum of the other two.
Vec3 random_moments(Philox& random) {
  Vec3 second;
  for (int k = 0; k < 3; ++k) second[k] = std::exp(random.uniform(std::log(1e-3), 0));
  return Vec3::Constant(second.sum()) - second;
}

Turning random_body(Philox& random) {
  Turning body;
  body.moments = random_moments(random);
  body.axes = any_turn(random);
  body.orientation = any_turn(random);
  return body;
}

Quat turn_by(double angle, const Vec3& axis) { return Quat(Eigen::AngleAxisd(angle, axis)); }

// For any angle, to 3e-7 of it. Only about the axis of the largest or smallest moment: about the
// middle one a body eventually tumbles.
TEST(FreeRotation, AboutAPrincipalAxisItTurnsBySpinTimesTime) {
  Philox random(1, Stream::test, 0);
  for (const double angle : {1e-9, 1e-3, 0.1, 0.4, 0.5, 0.6, 1.0, 3.0, 10.0}) {
    for (int i = 0; i < 30; ++i) {
      Turning body = random_body(random);
      int k;
      i % 2 == 0 ? body.moments.minCoeff(&k) : body.moments.maxCoeff(&k);
      const Vec3 axis = body.principal() * Vec3::Unit(k);
      const double step_s = random.uniform(1e-3, 1);
      body.spin = angle / step_s * axis;
      const Turning before = body;
      body.step(step_s);
      const Quat expected = turn_by(angle, axis) * before.orientation;
      EXPECT_LT(body.orientation.angularDistance(expected), 4e-7 * angle + 1e-7) << angle;
      EXPECT_LT((body.spin - before.spin).norm(), 1e-9 * before.spin.norm()) << angle;
    }
  }
}

// A symmetric top turns about its axis and, with it, about the angular momentum at L / I_across.
// The step size does not matter, since the two rotations are applied one after the other.
TEST(FreeRotation, ATopIsItsClosedForm) {
  Philox random(2, Stream::test, 0);
  for (int i = 0; i < 300; ++i) {
    Turning top = random_body(random);
    const int k = i % 3;
    const double across = random.uniform(0.55, 3);  // of a solid, flat as a coin or long as a rod
    top.moments = Vec3::Constant(across);
    top.moments[k] = random.uniform(0.01, 1) * 2 * across;
    const double turn = random.uniform(0.01, 4);
    top.spin = turn * random.direction();
    const Vec3 momentum = top.momentum();
    const double along = (top.principal().conjugate() * momentum)[k];
    const Quat expected = turn_by(momentum.norm() / across, momentum.normalized()) *
                          top.principal() *
                          turn_by(along * (1 / top.moments[k] - 1 / across), Vec3::Unit(k));
    top.step(1);
    const double turned = momentum.norm() * (1 / across + 1 / top.moments[k]);
    EXPECT_LT(top.principal().angularDistance(expected), 4e-7 * turned + 1e-7) << i;
  }
}

// Within rounding. The energy oscillates with steps of up to 2 rad, but does not drift.
TEST(FreeRotation, MomentumIsKeptAndEnergyDoesNotDrift) {
  Philox random(3, Stream::test, 0);
  double most = 0;
  for (int i = 0; i < 100; ++i) {
    Turning body = random_body(random);
    body.spin = random.uniform(0.01, 2) * random.direction();
    const Vec3 momentum = body.momentum();
    const double energy = body.energy();
    for (int step = 0; step < 500; ++step) {
      body.step(1);
      most = std::max(most, std::abs(body.energy() / energy - 1));
    }
    EXPECT_LT((body.momentum() - momentum).norm(), 1e-12 * momentum.norm()) << i;
  }
  EXPECT_LT(most, 0.06);
}

// Euler's equations by the classical fourth-order method, in small steps.
Turning reference(Turning body, double time_s) {
  constexpr int kSteps = 2000;
  const double h = time_s / kSteps;
  const Vec3 momentum = body.momentum();
  const auto rate = [&](const Eigen::Vector4d& q) {
    const Quat principal = Quat(q).normalized();
    const Vec3 spin = principal * (principal.conjugate() * momentum).cwiseQuotient(body.moments);
    return Eigen::Vector4d(0.5 * (Quat(0, spin.x(), spin.y(), spin.z()) * Quat(q)).coeffs());
  };
  Eigen::Vector4d q = body.principal().coeffs();
  for (int i = 0; i < kSteps; ++i) {
    const Eigen::Vector4d k1 = rate(q), k2 = rate(q + h / 2 * k1);
    const Eigen::Vector4d k3 = rate(q + h / 2 * k2), k4 = rate(q + h * k3);
    q += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
  }
  const Quat principal = Quat(q).normalized();
  body.orientation = principal * body.axes.conjugate();
  body.spin = principal * (principal.conjugate() * momentum).cwiseQuotient(body.moments);
  return body;
}

// Proportional to the square of the step, as for a symmetric splitting.
TEST(FreeRotation, HalfTheStepIsAFourthOfTheError) {
  Philox random(4, Stream::test, 0);
  double sums[3] = {};
  for (int i = 0; i < 100; ++i) {
    Turning start = random_body(random);
    start.spin = 0.8 * random.direction();
    const Turning expected = reference(start, 1);
    for (int k = 0; k < 3; ++k) {
      const int steps = 32 << k;  // each in one part
      Turning body = start;
      for (int step = 0; step < steps; ++step) body.step(1.0 / steps);
      sums[k] += body.orientation.angularDistance(expected.orientation);
    }
  }
  EXPECT_LT(sums[0] / 100, 1e-4);
  EXPECT_NEAR(sums[0] / sums[1], 4, 0.02);
  EXPECT_NEAR(sums[1] / sums[2], 4, 0.02);
}

}  // namespace
}  // namespace pilesim
