// Bodies in rooms.
#include "simulate/modes/make_simulator.h"
#include "support/room.h"
#include "support/small_simulation.h"

#include <gtest/gtest.h>

namespace pilesim {
namespace {

TEST(Rooms, HoldWhatIsInThem) {
  for (const SimulatorMode mode : {SimulatorMode::impulse, SimulatorMode::particle}) {
    Room room({1, 1, 1});
    room.scene.simulator.mode = mode;
    room.scene.frame_rate = 60;
    room.scene.step_s = 1.0 / 240;
    const auto simulator = make_simulator(room.scene, room.model);
    run(*simulator, 120);
    const Vec3& place = simulator->states().position[1];
    EXPECT_GT(place.y(), 0.08);
    EXPECT_LT(place.y(), 0.2);
  }
}

}  // namespace
}  // namespace pilesim
