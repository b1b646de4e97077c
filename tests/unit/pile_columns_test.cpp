// The ground area that bodies cover.
#include <gtest/gtest.h>

#include "geometry/primitives.h"
#include "pile/repose/body_columns.h"
#include "support/small_model.h"

namespace pilesim {
namespace {

TEST(BodyColumns, AreTheHighestPointsOfTheirCells) {
  const std::vector<Vec3> points = {{0, 0, 0}, {0, 0.3, 0}, {0, 0.1, 0}, {-0.2, 0.5, 0}};
  const std::vector<Column> columns =
      columns_of(points, {Vec3(0.05, 1, 0.25), Quat::Identity()}, 0.1);
  ASSERT_EQ(columns.size(), 2);
  EXPECT_EQ(columns[0].x, -2);
  EXPECT_EQ(columns[0].z, 2);
  EXPECT_DOUBLE_EQ(columns[0].top_m, 1.5);
  EXPECT_EQ(columns[1].x, 0);
  EXPECT_DOUBLE_EQ(columns[1].top_m, 1.3);
  const Quat onto_z(Eigen::AngleAxisd(kPi / 2, Vec3::UnitX()));
  EXPECT_EQ(columns_of({{0, 0.35, 0}}, {Vec3::Zero(), onto_z}, 0.1)[0].z, 3);
}

struct Cubes : SmallModel {
  Cubes() {
    scene.step_s = 1.0 / 120;
    const uint32_t wood = material(0.1, 0.5);
    body(plane(), wood, Vec3::Zero(), Role::fixed);
    body(box(Vec3::Constant(0.2)), wood, Vec3(0, 0.1, 0));
  }
};

TEST(BodyColumns, FollowTheBody) {
  const Cubes cubes;
  const PileBodies bodies(cubes.model);
  BodyColumns columns(cubes.model, bodies, 0.05);
  BodyMotion motion{.position = Vec3(0.025, 0.1, 0.025), .orientation = Quat::Identity()};
  const auto top_m = [&] {
    double top = 0;
    for (const Column& column : columns.of(1, motion)) top = std::max(top, column.top_m);
    return top;
  };
  EXPECT_DOUBLE_EQ(top_m(), 0.2);
  motion.position.y() = 0.4;
  EXPECT_DOUBLE_EQ(top_m(), 0.5) << "it rose";
  motion.orientation = Quat(Eigen::AngleAxisd(kPi / 4, Vec3::UnitX()));
  EXPECT_NEAR(top_m(), 0.4 + 0.1 * std::sqrt(2.0), 1e-9) << "it stands on an edge";
}

}  // namespace
}  // namespace pilesim
