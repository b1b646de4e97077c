// Contact points of two bodies represented by ellipsoids.

#include "simulate/sphere/body_ellipsoid.h"

#include <gtest/gtest.h>

#include "core/philox.h"
#include "support/random_vectors.h"

namespace pilesim {
namespace {

constexpr float kFar = 1e3F;

// Semi-axes relative to the radius of a ball of the same volume.
EllipsoidForm form_of(const Vec3f& axes) {
  const Vec3f unit = axes / std::cbrt(axes.prod());
  return {Eigen::Matrix3f(unit.cwiseAbs2().asDiagonal()), unit.maxCoeff(), unit.minCoeff()};
}

struct Placed {
  EllipsoidForm form;
  Quatf orientation;
  float radius_m;
  BodyEllipsoid ellipsoid() const { return form.placed(orientation, radius_m); }
};

Placed random_one(Philox& random) {
  const auto axis = [&] { return static_cast<float>(std::exp(random.uniform(-1.5, 1.5))); };
  return {form_of({axis(), axis(), axis()}), random.rotation().cast<float>(),
          static_cast<float>(random.uniform(0.05, 2))};
}

class Ellipsoids : public testing::TestWithParam<uint64_t> {
 protected:
  Vec3f way() { return random_.direction().cast<float>(); }
  Philox random_ = Philox(GetParam(), Stream::test, 0);
};

TEST_P(Ellipsoids, BallsTouchAsBallsWhateverTheirSizes) {
  const auto a = static_cast<float>(random_.uniform(0.01, 2));
  const auto b = static_cast<float>(random_.uniform(0.01, 2));
  const auto distance = static_cast<float>(random_.uniform(0.5, 1.5)) * (a + b);
  const Vec3f apart = distance * way();
  const auto contact = contact_of(BodyEllipsoid::ball(a), BodyEllipsoid::ball(b), apart, kFar);
  ASSERT_TRUE(contact);
  EXPECT_LT((contact->normal - apart / distance).norm(), 1e-5);
  EXPECT_NEAR(contact->gap, distance - a - b, 1e-5 * (a + b));
  EXPECT_EQ(contact->arm_a, a);
  EXPECT_EQ(contact->arm_b, b);
}

// Also as an almost round ellipsoid.
TEST_P(Ellipsoids, AlmostRoundOnesTouchAsBalls) {
  const auto a = static_cast<float>(random_.uniform(0.01, 2));
  const auto b = static_cast<float>(random_.uniform(0.01, 2));
  const EllipsoidForm form = form_of({1, 1, 1.0001F});
  const Vec3f apart = static_cast<float>(random_.uniform(0.5, 1.5)) * (a + b) * way();
  const auto contact =
      contact_of(form.placed(Quatf::Identity(), a), form.placed(Quatf::Identity(), b), apart, kFar);
  ASSERT_TRUE(contact);
  EXPECT_NEAR(contact->gap, apart.norm() - a - b, 1e-3 * (a + b));
  EXPECT_NEAR(contact->arm_a / contact->arm_b, a / b, 1e-3 * a / b);
}

// Needles and sheets of one micrometre and of ten kilometres.
TEST_P(Ellipsoids, AreFiniteHoweverThinTinyAndLarge) {
  for (const float radius_m : {1e-6F, 1.0F, 1e4F}) {
    for (const Vec3f& axes : {Vec3f(100, 1, 1), Vec3f(100, 100, 1), Vec3f(1, 20, 100)}) {
      const Placed one{form_of(axes), random_.rotation().cast<float>(), radius_m};
      const Vec3f unit = one.form.squares.diagonal().cwiseSqrt() * radius_m;
      const Vec3f apart = one.orientation * Vec3f(2 * unit.cwiseProduct(way()));
      const auto touching = contact_of(one.ellipsoid(), one.ellipsoid(), apart, kFar * radius_m);
      ASSERT_TRUE(touching);
      EXPECT_NEAR(touching->gap / (unit.minCoeff()), 0, 0.1) << radius_m << axes.transpose();
      const Placed other{one.form, random_.rotation().cast<float>(), radius_m};
      const auto any = contact_of(one.ellipsoid(), other.ellipsoid(), apart, kFar * radius_m);
      ASSERT_TRUE(any);
      EXPECT_TRUE(any->normal.allFinite() && std::isfinite(any->gap));
      EXPECT_TRUE(std::isfinite(any->arm_a) && std::isfinite(any->arm_b));
      const auto inside = contact_of(one.ellipsoid(), other.ellipsoid(), Vec3f::Zero(), 0);
      EXPECT_TRUE(inside && inside->normal.allFinite() && inside->gap < 0);
    }
  }
}

// Equal ellipsoids in equal orientation touch on the surface of one that is twice as large.
TEST_P(Ellipsoids, ThoseThatLieAlikeTouchExactly) {
  const Placed one = random_one(random_);
  const Vec3f axes = one.form.squares.diagonal().cwiseSqrt() * one.radius_m;
  const Vec3f on_ball = way();
  const Vec3f apart = one.orientation * Vec3f(2 * axes.cwiseProduct(on_ball));
  const Vec3f normal = one.orientation * Vec3f(on_ball.cwiseQuotient(axes));
  const auto contact = contact_of(one.ellipsoid(), one.ellipsoid(), apart, kFar);
  ASSERT_TRUE(contact);
  EXPECT_NEAR(contact->gap, 0, 1e-4 * one.radius_m);
  EXPECT_LT((contact->normal - normal.normalized()).norm(), 1e-3);
}

TEST_P(Ellipsoids, EachSeesTheOtherAlike) {
  const Placed a = random_one(random_), b = random_one(random_);
  const Vec3f apart =
      static_cast<float>(random_.uniform(0.2, 2)) * (a.radius_m + b.radius_m) * way();
  const auto here = contact_of(a.ellipsoid(), b.ellipsoid(), apart, kFar);
  const auto there = contact_of(b.ellipsoid(), a.ellipsoid(), -apart, kFar);
  ASSERT_TRUE(here && there);
  EXPECT_NEAR(here->gap, there->gap, 1e-5 * (a.radius_m + b.radius_m));
  EXPECT_LT((here->normal + there->normal).norm(), 1e-5);
}

// At contact, a step along the normal changes the gap by its length.
TEST_P(Ellipsoids, TheNormalIsTheWayOut) {
  const Placed a = random_one(random_), b = random_one(random_);
  Vec3f apart = (a.radius_m + b.radius_m) * way();
  for (int i = 0; i < 30; ++i) {
    const auto contact = contact_of(a.ellipsoid(), b.ellipsoid(), apart, kFar);
    ASSERT_TRUE(contact);
    apart -= 0.7F * contact->gap * contact->normal;
  }
  const auto there = contact_of(a.ellipsoid(), b.ellipsoid(), apart, kFar);
  const float small = 0.01F * std::min(a.ellipsoid().shortest_m, b.ellipsoid().shortest_m);
  ASSERT_NEAR(there->gap, 0, small);
  const auto out = contact_of(a.ellipsoid(), b.ellipsoid(), apart + small * there->normal, kFar);
  EXPECT_NEAR(out->gap - there->gap, small, 0.1 * small);
}

// The search finds all contacts within its reach.
TEST_P(Ellipsoids, NoneWithinReachIsMissed) {
  for (int i = 0; i < 200; ++i) {
    const Placed a = random_one(random_), b = random_one(random_);
    const float sum = a.radius_m + b.radius_m;
    const Vec3f apart = static_cast<float>(random_.uniform(0.1, 4)) * sum * way();
    const auto reach = static_cast<float>(random_.uniform(0, 1)) * sum;
    const auto all = contact_of(a.ellipsoid(), b.ellipsoid(), apart, 100 * kFar);
    ASSERT_TRUE(all);
    if (all->gap <= reach) {
      EXPECT_TRUE(contact_of(a.ellipsoid(), b.ellipsoid(), apart, reach));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Random, Ellipsoids, testing::Range<uint64_t>(1, 21));

}  // namespace
}  // namespace pilesim
