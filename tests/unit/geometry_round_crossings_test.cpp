// Lines through surfaces of revolution, against whether points are inside of the solids.
#include "geometry/round_crossings.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "core/philox.h"

namespace pilesim {
namespace {

struct RoundSolid {
  const char* name;
  RoundOutline outline;
  std::function<bool(const Vec3&)> holds;  // in the frame of the axis
};

double across(const Vec3& p) { return std::hypot(p.x(), p.z()); }

std::vector<RoundSolid> solids() {
  return {
      {"ball", ball_outline(0.5), [](const Vec3& p) { return p.norm() < 0.5; }},
      {"cylinder", frustum_outline(0.3, 0.3, 1.2),
       [](const Vec3& p) { return across(p) < 0.3 && std::abs(p.y()) < 0.6; }},
      {"cone", frustum_outline(0.6, 0, 0.8),
       [](const Vec3& p) { return p.y() > -0.4 && across(p) < 0.75 * (0.4 - p.y()); }},
      {"frustum", frustum_outline(0.2, 0.6, 0.8),
       [](const Vec3& p) { return std::abs(p.y()) < 0.4 && across(p) < 0.4 + 0.5 * p.y(); }},
      {"capsule", capsule_outline(0.2, 1),
       [](const Vec3& p) { return (p - Vec3(0, std::clamp(p.y(), -0.3, 0.3), 0)).norm() < 0.2; }},
      {"torus", torus_outline(0.5, 0.15),
       [](const Vec3& p) { return std::hypot(across(p) - 0.5, p.y()) < 0.15; }},
      {"tube", tube_outline(0.4, 0.35, 0.7),
       [](const Vec3& p) { return std::abs(p.y()) < 0.35 && across(p) < 0.4 && across(p) > 0.35; }},
  };
}

// At sizes from a millimetre to a kilometre, and from near and far away.
TEST(RoundCrossings, LinesAreInsideBetweenThem) {
  for (const RoundSolid& solid : solids()) {
    size_t met = 0;
    for (uint32_t trial = 0; trial < 2000; ++trial) {
      Philox random(7, Stream::test, trial, 0);
      const double size = std::pow(10.0, random.uniform(-3, 3));
      RoundSurface surface{.pose = {size * random.direction(), random.rotation()},
                           .outline = solid.outline};
      for (OutlinePoint& point : surface.outline) {
        point.radius *= size;
        point.y *= size;
      }
      const Vec3 aim = surface.pose.position + 0.6 * size * random.direction();
      const Vec3 direction = random.uniform(0.1, 10) * random.direction();
      const Vec3 origin = aim - size * random.uniform(-100, 100) * direction;
      const Crossings found = crossings(surface, origin, direction);
      std::vector<double> distances(found.begin(), found.end());
      std::ranges::sort(distances);
      ASSERT_EQ(distances.size() % 2, 0u) << solid.name << ' ' << trial;
      met += distances.size() / 2;
      const auto holds = [&](double distance) {
        const Vec3 at = origin + distance * direction - surface.pose.position;
        return solid.holds(surface.pose.orientation.conjugate() * at / size);
      };
      for (size_t i = 0; i < distances.size(); ++i) {
        const Vec3 place = origin + distances[i] * direction;
        const Vec3 normal = outward_normal(surface, place);
        EXPECT_NEAR(normal.norm(), 1, 1e-12);
        EXPECT_EQ(normal.dot(direction) < 0, i % 2 == 0) << solid.name << ' ' << trial;
        if (i + 1 == distances.size()) continue;
        // Rounding decides where the solid is thinner than that.
        const double gap = (distances[i + 1] - distances[i]) * direction.norm();
        if (gap < 1e-6 * size) continue;
        EXPECT_EQ(holds((distances[i] + distances[i + 1]) / 2), i % 2 == 0)
            << solid.name << ' ' << trial;
      }
      const double middle = (aim - origin).dot(direction) / direction.squaredNorm();
      if (distances.empty()) {
        for (int i = -20; i <= 20; ++i) {
          EXPECT_FALSE(holds(middle + 0.05 * i * size / direction.norm())) << solid.name;
        }
      }
      const Bounds box = bounds_of(surface);
      for (const double distance : distances) {
        const Vec3 place = origin + distance * direction;
        EXPECT_LT(box.exteriorDistance(place), 1e-9 * size) << solid.name;
      }
    }
    EXPECT_GT(met, 300u) << solid.name;
  }
}

TEST(RoundCrossings, NormalsAreThoseOfTheClosedForm) {
  const RoundSurface ring{.outline = torus_outline(2, 0.5)};
  const RoundSurface ball{.outline = ball_outline(2)};
  const RoundSurface cone{.outline = frustum_outline(1, 0, 2)};
  for (uint32_t trial = 0; trial < 200; ++trial) {
    Philox random(8, Stream::test, trial, 0);
    const double turn = random.uniform(0, 2 * kPi), over = random.uniform(0, 2 * kPi);
    const Vec3 out(std::cos(turn), 0, std::sin(turn));
    const Vec3 normal = std::cos(over) * out + std::sin(over) * Vec3::UnitY();
    EXPECT_LT((outward_normal(ring, 2 * out + 0.5 * normal) - normal).norm(), 1e-9);
    const Vec3 direction = random.direction();
    EXPECT_LT((outward_normal(ball, 2 * direction) - direction).norm(), 1e-9);
    const double y = random.uniform(-0.9, 0.9);
    const Vec3 slope = (2 * out + Vec3::UnitY()).normalized();
    EXPECT_LT((outward_normal(cone, (1 - y) / 2 * out + y * Vec3::UnitY()) - slope).norm(), 1e-9);
  }
}

}  // namespace
}  // namespace pilesim
