// Meshes that are primitives are recognised at any position and orientation; near misses are not.
#include "geometry/primitive_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <vector>

#include "geometry/convex_hull.h"
#include "geometry/primitives.h"

namespace pilesim {
namespace {

using Kind = FittedPrimitive::Kind;

// A body of revolution about y: circles of `sides` corners, points where the radius is 0.
TriangleMesh turned(const std::vector<std::pair<double, double>>& profile, int sides) {
  std::vector<Vec3> points;
  for (const auto& [y, radius] : profile) {
    for (int i = 0; i < (radius > 0 ? sides : 1); ++i) {
      const double angle = 2 * kPi * i / sides;
      points.emplace_back(radius * std::cos(angle), y, radius * std::sin(angle));
    }
  }
  return convex_hull(points);
}

std::vector<std::pair<double, double>> ellipse(double along, double across, double straight = 0) {
  std::vector<std::pair<double, double>> profile;
  constexpr int kRings = 24;  // of a half
  for (int i = 0; i <= 2 * kRings; ++i) {
    const double angle = kPi * (i - kRings) / (2.0 * kRings);
    const bool is_pole = i == 0 || i == 2 * kRings;
    const double y = along * std::sin(angle), half = straight / 2;
    const double radius = is_pole ? 0 : across * std::cos(angle);
    if (i == kRings && straight > 0) profile.emplace_back(-half, radius);
    profile.emplace_back(y + (i < kRings ? -half : half), radius);
  }
  return profile;
}

const std::vector<Pose> kPoses = {
    {},
    {{3, -2, 7}, Quat(Eigen::AngleAxisd(kPi / 2, Vec3::UnitX()))},
    {{-0.2, 0.1, 0}, Quat(Eigen::AngleAxisd(kPi / 2, Vec3::UnitZ()))},
    {{0.4, 5, -1}, Quat(Eigen::AngleAxisd(1.234, Vec3(1, -2, 0.5).normalized()))}};

TriangleMesh placed(TriangleMesh mesh, const Pose& pose) {
  for (Vec3& vertex : mesh.vertices) vertex = pose.apply(vertex);
  return mesh;
}

struct Case {
  const char* name;
  Kind kind;
  TriangleMesh mesh;
  Vec3 size;
};

std::vector<Case> primitives() {
  return {
      {"icosphere", Kind::ball, sphere_mesh(0.1, 3), Vec3::Constant(0.1)},
      {"coarse icosphere", Kind::ball, sphere_mesh(2, 2), Vec3::Constant(2)},
      {"globe", Kind::ball, turned(ellipse(1, 1), 48), Vec3::Constant(1)},
      {"box", Kind::box, box_mesh({0.3, 0.1, 0.7}), {0.3, 0.1, 0.7}},
      {"cube", Kind::box, box_mesh({1, 1, 1}), {1, 1, 1}},
      {"plate", Kind::box, box_mesh({1, 0.01, 0.5}), {1, 0.01, 0.5}},
      {"cylinder", Kind::cylinder, cylinder_mesh(0.5, 2), {0.5, 2, 0.5}},
      {"cylinder of 16", Kind::cylinder, cylinder_mesh(0.5, 1, 16), {0.5, 1, 0.5}},
      {"as a ball inertially",
       Kind::cylinder,
       cylinder_mesh(1, std::sqrt(3.0)),
       {1, std::sqrt(3.0), 1}},
      {"coin", Kind::cylinder, cylinder_mesh(0.01, 0.001, 64), {0.01, 0.001, 0.01}},
      {"rod", Kind::cylinder, cylinder_mesh(0.01, 3, 24), {0.01, 3, 0.01}},
      {"cone", Kind::cone, turned({{-0.5, 0.4}, {0.5, 0}}, 40), {0.4, 1, 0.4}},
      {"capsule", Kind::capsule, turned(ellipse(0.2, 0.2, 0.6), 40), {0.2, 1, 0.2}},
  };
}

TEST(PrimitiveFit, FindsPrimitivesAtAnyPlaceAndTurn) {
  for (const Case& each : primitives()) {
    for (size_t k = 0; k < kPoses.size(); ++k) {
      SCOPED_TRACE(std::string(each.name) + ", pose " + std::to_string(k));
      const Pose& pose = kPoses[k];
      const auto found = fit_primitive(placed(each.mesh, pose));
      ASSERT_TRUE(found);
      ASSERT_EQ(found->kind, each.kind);
      const double size = each.size.maxCoeff();
      EXPECT_LT((found->pose.position - pose.position).norm(), 1e-9 * size + 1e-12);
      if (each.kind == Kind::box) {
        Vec3 sides = found->size, wanted = each.size;
        std::ranges::sort(sides);
        std::ranges::sort(wanted);
        EXPECT_LT((sides - wanted).norm(), 1e-9 * size);
      } else {
        EXPECT_LT((found->size - each.size).norm(), 1e-6 * size);
      }
      if (each.kind != Kind::box && each.kind != Kind::ball) {
        const Vec3 axis = found->pose.orientation * Vec3::UnitY();
        const double along = axis.dot(pose.orientation * Vec3::UnitY());
        EXPECT_GT(each.kind == Kind::cone ? along : std::abs(along), 1 - 1e-9);
      }
    }
  }
}

TEST(PrimitiveFit, LeavesWhatIsNearlyOne) {
  TriangleMesh dented = sphere_mesh(1, 3), skewed = box_mesh({1, 1, 1});
  for (Vec3& vertex : dented.vertices) vertex.y() = std::max(vertex.y(), -0.97);
  for (Vec3& vertex : skewed.vertices) vertex.x() *= vertex.y() > 0 ? 0.99 : 1;
  TriangleMesh slanted = cylinder_mesh(1, 1);
  for (Vec3& vertex : slanted.vertices) vertex.y() += vertex.y() > 0 ? 0.01 * vertex.x() : 0;
  const std::vector<std::pair<const char*, TriangleMesh>> meshes = {
      {"egg", turned(ellipse(1.02, 1), 48)},
      {"long egg", turned(ellipse(1.3, 1), 48)},
      {"icosahedron", sphere_mesh(1, 0)},
      {"80 faces", sphere_mesh(1, 1)},
      {"hexagonal prism", cylinder_mesh(1, 1, 6)},
      {"prism of 12", cylinder_mesh(1, 1, 12)},
      {"square prism on end", turned({{-1, 1}, {1, 0.9}}, 4)},
      {"bucket", turned({{-1, 1}, {1, 1.01}}, 48)},
      {"slanted cut", slanted},
      {"blunt cone", turned({{-0.5, 0.4}, {0.5, 0.05}}, 48)},
      {"pyramid", turned({{-0.5, 0.4}, {0.5, 0}}, 4)},
      {"cylinder with a bevel", turned({{-1, 0.9}, {-0.9, 1}, {0.9, 1}, {1, 0.9}}, 48)},
      {"ball with a flat foot", dented},
      {"skewed box", skewed}};
  for (const auto& [name, mesh] : meshes) {
    for (const Pose& pose : kPoses) EXPECT_FALSE(fit_primitive(placed(mesh, pose))) << name;
  }
}

TEST(PrimitiveFit, SaysHowFarItIs) {
  const auto found = fit_primitive(cylinder_mesh(1, 1, 32));
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->surface_error_m, 1 - std::cos(kPi / 32), 1e-9);
  EXPECT_NEAR(found->volume_m3(), kPi, 1e-9);
}

}  // namespace
}  // namespace pilesim
