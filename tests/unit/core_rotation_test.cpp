#include "core/rotation.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/philox.h"

namespace pilesim {
namespace {

// From nearly equal to nearly opposite directions, of any length.
TEST(Rotation, TurnsOneDirectionToTheOther) {
  Philox random(1, Stream::test, 0);
  for (int i = 0; i < 2000; ++i) {
    const Vec3 from = std::exp(random.uniform(-20, 20)) * random.direction();
    const double apart = std::exp(random.uniform(-40, 1));
    const Vec3 near = from.normalized() + apart * random.direction();
    for (const Vec3& to : {near, Vec3(-near)}) {
      const Quat turn = rotation_between(from, to);
      EXPECT_NEAR(turn.norm(), 1, 1e-14);
      EXPECT_LT((turn * from.normalized() - to.normalized()).norm(), 1e-14) << from.transpose();
      // The least turn is about an axis across both.
      EXPECT_LT(std::abs(turn.vec().dot(from.normalized())), 1e-14);
      const Quatf rough = float_rotation_between(from.cast<float>(), to.cast<float>());
      EXPECT_LT((rough.cast<double>() * from.normalized() - to.normalized()).norm(), 1e-5);
    }
  }
}

TEST(Rotation, OfOppositeDirectionsIsHalfATurn) {
  for (int k = 0; k < 3; ++k) {
    const Quat turn = rotation_between(Vec3::Unit(k), -2 * Vec3::Unit(k));
    EXPECT_EQ(turn.w(), 0);
    EXPECT_EQ(turn * Vec3(Vec3::Unit(k)), Vec3(-Vec3::Unit(k)));
  }
}

}  // namespace
}  // namespace pilesim
