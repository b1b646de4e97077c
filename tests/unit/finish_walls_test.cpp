// Bodies that reach through walls.
#include "finish/walls.h"
#include "support/room.h"

#include <gtest/gtest.h>

namespace pilesim {
namespace {

TEST(Rooms, FinishingDrawsBackIntoThem) {
  Room room({1, 1, 1});
  BodyStates states = room.states();
  states.position[1] = {1, 0.03, 1};
  draw_back_from_walls(room.model, {1}, {0}, states);
  EXPECT_NEAR(states.position[1].y(), 0.1, 1e-6);
}

}  // namespace
}  // namespace pilesim
