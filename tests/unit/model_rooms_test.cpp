// Recognition of meshes that are rooms.
#include "support/room.h"

#include <gtest/gtest.h>

namespace pilesim {
namespace {

TEST(Rooms, AreThoseInWhichBodiesBegin) {
  EXPECT_TRUE(Room({1, 1, 1}).is_open());
  EXPECT_NE(Room({1, 1, 1}).model.shapes[0].collision_report.find("a room"), std::string::npos);
  EXPECT_FALSE(Room({1, 1, 1}, true).is_open()) << "it is touched from inside as it is";
  EXPECT_FALSE(Room({1, 3.2, 1}).is_open()) << "on it";
  EXPECT_FALSE(Room({1, 2.95, 1}).is_open()) << "embedded in it";
  EXPECT_FALSE(Room({1, 6, 1}).is_open());
}

TEST(Rooms, OneBodyInAHillMakesNoneOfIt) {
  Room hill({1, 1, 1});
  hill.model.shapes[0].mesh = hill.before;
  for (int i = 0; i < 3; ++i) hill.body(hill.cube, 0, {i - 1.0, 2.99, 0});
  open_rooms(hill.model);
  EXPECT_FALSE(hill.is_open());
}

TEST(Rooms, LeaveOthersOfTheirShapeAsTheyAre) {
  Room room({1, 1, 1});
  room.model.shapes[0].mesh = room.before;
  room.body(0, 0, {10, 1.5, 0}, Role::fixed);
  open_rooms(room.model);
  EXPECT_FALSE(room.is_open());
  ASSERT_EQ(room.model.shapes.size(), 3);
  EXPECT_EQ(room.model.bodies[0].shape, 2);
  EXPECT_EQ(room.model.bodies[2].shape, 0);
}

TEST(Rooms, AreThoseInWhichAGuideIsFilled) {
  Room room({1, 6, 1});
  ASSERT_FALSE(room.is_open());
  room.body(room.cube, 0, Vec3::Zero());
  room.model.guide_fill = {2, 1, 0, true};
  room.model.guide = box_mesh({1, 1, 1});
  open_rooms(room.model);
  EXPECT_FALSE(room.is_open()) << "half of the guide is below the floor";
  for (Vec3& vertex : room.model.guide.vertices) vertex.y() += 0.5;  // it stands on the floor
  open_rooms(room.model);
  EXPECT_TRUE(room.is_open());
}

}  // namespace
}  // namespace pilesim
