// The candidates for a contact against all vertices.
#include "signature/trial/support_map.h"

#include <gtest/gtest.h>

#include "support/signature_bodies.h"

namespace pilesim {
namespace {

class SupportMaps : public testing::TestWithParam<int> {};

TEST_P(SupportMaps, HaveTheLowestVertexOfEveryNormalNearby) {
  Philox random(29, Stream::test, static_cast<uint64_t>(GetParam()));
  const ContactBody body =
      GetParam() == 0 ? test::box_body({1, 0.1, 0.1}) : test::random_body(random, 40 * GetParam());
  for (int i = 0; i < 20000; ++i) {
    const double deviation = random.uniform() * SupportMap::kDeviations.back();
    const Vec3 middle = random.direction();
    const Vec3 aside = middle.cross(random.direction()).normalized();
    // At the limit of the request, or anywhere within.
    const double angle = std::asin(deviation) * (i % 2 == 0 ? 1 : random.uniform());
    const Vec3 normal = std::cos(angle) * middle + std::sin(angle) * aside;
    uint32_t lowest = 0;
    for (uint32_t v = 1; v < body.vertex_count(); ++v) {
      if (normal.dot(body.vertices[v]) < normal.dot(body.vertices[lowest])) lowest = v;
    }
    const double height = -normal.dot(body.vertices[lowest]);
    const SupportMap::Candidates near = body.support.around(3 * middle, deviation);
    EXPECT_LE(height, near.height_m);
    bool found = false;
    for (const SupportMap::Group& group : near.groups) {
      for (const uint32_t vertex : group.vertex) {
        found = found ||
                (normal.dot(body.vertices[vertex]) <= normal.dot(body.vertices[lowest]) + 1e-12);
      }
    }
    EXPECT_TRUE(found) << i;
    EXPECT_NEAR(lowest_vertex(body, normal).height_m, height, 1e-12);
  }
}

TEST(SupportMapOfABall, LeavesMostVerticesOut) {
  const ContactBody body = make_contact_body(sphere_mesh(1, 4), Mat3::Identity());
  Philox random(31, Stream::test, 0);
  for (int i = 0; i < 1000; ++i) {
    const Vec3 normal = random.direction();
    const size_t few = body.support.around(normal, 0.01).groups.size();
    const size_t many = body.support.around(normal, SupportMap::kDeviations.back()).groups.size();
    EXPECT_LE(few, many);
    EXPECT_LT(few * SupportMap::kGroup, body.vertex_count() / 20);
    EXPECT_LT(many * SupportMap::kGroup, body.vertex_count() / 5);
  }
}

INSTANTIATE_TEST_SUITE_P(Bodies, SupportMaps, testing::Range(0, 5));

}  // namespace
}  // namespace pilesim
