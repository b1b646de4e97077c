// The range of heights on the lowest vertex, and that vertex, against all vertices.
#include "signature/support_range.h"

#include <gtest/gtest.h>

#include "support/signature_bodies.h"

namespace pilesim {
namespace {

double support_of(const ContactBody& body, const Vec3& normal) {
  double height = 0;
  for (const Vec3& v : body.vertices) height = std::max(height, -normal.dot(v));
  return height;
}

class SupportRanges : public testing::TestWithParam<int> {};

TEST_P(SupportRanges, HoldForEveryNormalNearby) {
  Philox random(29, Stream::test, static_cast<uint64_t>(GetParam()));
  const ContactBody body =
      GetParam() == 0 ? test::box_body({1, 0.1, 0.1}) : test::random_body(random, 40 * GetParam());
  for (int i = 0; i < 20000; ++i) {
    // Beyond the last angle there is one range for all normals.
    const double deviation = random.uniform() * 1.2 * SupportRange::kDeviations.back();
    const Vec3 middle = random.direction();
    const Vec3 aside = middle.cross(random.direction()).normalized();
    // At the edge of what is asked for, or anywhere within.
    const double angle = std::asin(deviation) * (i % 2 == 0 ? 1 : random.uniform());
    const Vec3 normal = std::cos(angle) * middle + std::sin(angle) * aside;
    const double height = support_of(body, normal);
    const SupportRange::Range range = body.support.around(3 * middle, deviation);
    EXPECT_LE(height, range.most_m);
    EXPECT_GE(height, range.least_m);
    const Support support = lowest_vertex(body, normal);
    EXPECT_NEAR(support.height_m, height, 1e-12);
    EXPECT_NEAR(-normal.dot(body.vertices[support.vertex]), height, 1e-12);
  }
}

INSTANTIATE_TEST_SUITE_P(Bodies, SupportRanges, testing::Range(0, 5));

TEST(SupportRangeOfABall, IsNarrow) {
  const ContactBody body = make_contact_body(sphere_mesh(1, 3), Mat3::Identity());
  Philox random(31, Stream::test, 0);
  for (int i = 0; i < 1000; ++i) {
    const Vec3 normal = random.direction();
    const SupportRange::Range narrow = body.support.around(normal, 0.01);
    const SupportRange::Range wide = body.support.around(normal, 0.3);
    EXPECT_LE(narrow.most_m, wide.most_m);
    EXPECT_GE(narrow.least_m, wide.least_m);
    EXPECT_LT(wide.most_m, 1.001);
    EXPECT_GT(narrow.least_m, 0.97);
    EXPECT_GT(wide.least_m, 0.85);
  }
}

}  // namespace
}  // namespace pilesim
