#include "core/philox.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

namespace pilesim {
namespace {

// Known answers of Philox4x32-10 from the tests of Salmon et al.: this is the published generator.
TEST(Philox, GivesTheKnownAnswers) {
  const r123::Philox4x32 generator;
  const auto expect = [&](r123::Philox4x32::ctr_type counter, r123::Philox4x32::key_type key,
                          const std::array<uint32_t, 4>& answer) {
    const auto block = generator(counter, key);
    for (size_t i = 0; i < 4; ++i) EXPECT_EQ(block[i], answer[i]) << i;
  };
  expect({{0, 0, 0, 0}}, {{0, 0}}, {0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8});
  expect({{~0u, ~0u, ~0u, ~0u}}, {{~0u, ~0u}}, {0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd});
  expect({{0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344}}, {{0xa4093822, 0x299f31d0}},
         {0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1});
}

TEST(Philox, DependsOnAllOfItsKeysAndOnNothingElse) {
  const auto first = [](uint64_t seed, Stream stream, uint64_t object, uint32_t event) {
    return Philox(seed, stream, object, event).uniform();
  };
  const double reference = first(7, Stream::test, 3, 2);
  EXPECT_EQ(first(7, Stream::test, 3, 2), reference);
  EXPECT_NE(first(8, Stream::test, 3, 2), reference);
  EXPECT_NE(first(7ull << 32, Stream::test, 3, 2), reference);
  EXPECT_NE(first(7, Stream::emitter, 3, 2), reference);
  EXPECT_NE(first(7, Stream::test, 4, 2), reference);
  EXPECT_NE(first(7, Stream::test, 3ull << 32, 2), reference);
  EXPECT_NE(first(7, Stream::test, 3, 3), reference);
}

// Means of n samples are within five standard errors of the closed form.
TEST(Philox, DrawsHaveTheirDistributions) {
  constexpr int kDraws = 200000;
  Philox random(1, Stream::test, 0);
  double uniform = 0, uniform2 = 0, normal = 0, normal2 = 0;
  Vec3 direction = Vec3::Zero();
  Mat3 rotation = Mat3::Zero();
  std::array<int, 6> faces{};
  for (int i = 0; i < kDraws; ++i) {
    const double u = random.uniform();
    ASSERT_TRUE(u > 0 && u < 1);
    uniform += u;
    uniform2 += u * u;
    const double g = random.normal();
    normal += g;
    normal2 += g * g;
    const Vec3 d = random.direction();
    ASSERT_NEAR(d.norm(), 1, 1e-12);
    direction += d;
    const Quat q = random.rotation();
    ASSERT_NEAR(q.norm(), 1, 1e-12);
    rotation += q.toRotationMatrix();
    ++faces[random.index(6)];
  }
  const double n = kDraws;
  const double error = 5 / std::sqrt(n);
  EXPECT_NEAR(uniform / n, 1.0 / 2, error * std::sqrt(1.0 / 12));
  EXPECT_NEAR(uniform2 / n, 1.0 / 3, error * std::sqrt(4.0 / 45));
  EXPECT_NEAR(normal / n, 0, error);
  EXPECT_NEAR(normal2 / n, 1, error * std::sqrt(2.0));
  EXPECT_LT((direction / n).cwiseAbs().maxCoeff(), error * std::sqrt(1.0 / 3));
  EXPECT_LT((rotation / n).cwiseAbs().maxCoeff(), error * std::sqrt(1.0 / 3));
  for (const int count : faces) EXPECT_NEAR(count / n, 1.0 / 6, error * std::sqrt(5.0 / 36));
}

}  // namespace
}  // namespace pilesim
