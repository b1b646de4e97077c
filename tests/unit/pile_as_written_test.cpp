// Section 5.2 of the dissertation to the letter, on hand-made states.
#include <gtest/gtest.h>

#include <algorithm>

#include "pile/repose/repose_director.h"
#include "support/constructed_piles.h"

namespace pilesim {
namespace {

constexpr double kSide = 0.2;

struct PiledBoxes : SmallModel {
  explicit PiledBoxes(const std::vector<Vec3>& centres) {
    scene.step_s = 1.0 / 120;
    scene.piles = {
        {.angle = radians(35), .method = Method::dissertation, .centre = GroundPoint(0, 0)}};
    const uint32_t wood = material(0.1, 0.5);
    body(plane(), wood, Vec3::Zero(), Role::fixed);
    const uint32_t shape = box(Vec3::Constant(kSide));
    for (const Vec3& centre : centres) body(shape, wood, centre);
  }
};

// 5.2.3: rho_i d / (1 + |v|) against tau. The structure has room for 16 cubes of the median box,
// and one is in its lowest layer.
TEST(PileAsWritten, BodiesThatScoreMoreThanTauSleep) {
  for (const double speed : {0.0, 1.0}) {
    for (const double distance_m : {0.0, 0.1}) {
      const Vec3 centre(distance_m, kSide / 2, 0);
      PiledBoxes boxes({centre});
      StackingStructure structure(PileShape(boxes.scene.piles[0], GroundPoint::Zero()),
                                  16 * std::pow(kSide, 3), std::sqrt(3.0) * kSide);
      ASSERT_TRUE(structure.count(centre.y(), distance_m, std::pow(kSide, 3), false));
      const size_t layer = structure.layer_at(centre.y());
      const double radius_m = structure.layers()[layer].reach_m;
      const double score = std::pow(kSide, 3) / structure.layers()[layer].volume_m3 *
                           (radius_m - distance_m) / radius_m / (1 + speed);
      for (const double share : {0.99, 1.01}) {
        boxes.scene.piles[0].tau = share * score;
        ConstructedWorld world(boxes);
        world.motions[1].linear_velocity = {0, 0, speed};
        ReposeDirector director(boxes.scene, boxes.model);
        world.step(director, 2);
        EXPECT_EQ(world.asleep[1] != 0, share < 1) << speed << " m/s at " << distance_m << " m";
      }
    }
  }
}

// 5.2.4: when a layer becomes denser than 0.8 all bodies wake, wherever they are, and are simulated
// for some time; a layer that stays as dense wakes nothing again.
TEST(PileAsWritten, ALayerThatBecomesTooDenseWakesAllOnce) {
  // A steep cone for 16 cubes is four layers high, and 8 of them are 0.86 of the lowest one.
  std::vector<Vec3> centres = {{30, kSide / 2, 0}};
  for (int i = 0; i < 8; ++i) centres.push_back({0.01 * i, kSide / 2, 0});
  PiledBoxes boxes(centres);
  boxes.scene.piles[0].angle = radians(80);
  boxes.scene.piles[0].tau = 0.999;  // nothing else falls asleep
  ConstructedWorld world(boxes);
  std::ranges::fill(world.asleep, 1);
  ReposeDirector director(boxes.scene, boxes.model);
  world.step(director, 20);
  EXPECT_EQ(std::ranges::count(world.asleep, 1), 1) << "the ground";
  EXPECT_GE(director.woken_by_avalanches(), centres.size());
  std::ranges::fill(world.asleep, 1);
  world.step(director, 200);
  EXPECT_EQ(std::ranges::count(world.asleep, 0), 0);
}

// 5.2.4: "it is necessary to wake the entire pile". The project's method wakes the bodies that the
// impact can move.
TEST(PileAsWritten, AHardHitWakesTheWholePile) {
  PiledBoxes boxes({{0, kSide / 2, 0}, {30, kSide / 2, 0}, {0, 0.5, 0}});
  for (const double speed : {1.0, 50.0}) {
    ConstructedWorld world(boxes);
    world.asleep[1] = world.asleep[2] = 1;
    world.motions[3].linear_velocity = {0, -speed, 0};
    ReposeDirector director(boxes.scene, boxes.model);
    world.step(director, 2);
    EXPECT_EQ(world.asleep[1], speed < 10) << speed;
    EXPECT_EQ(world.asleep[2], speed < 10) << speed;
  }
}

// "The only change to the fundamental simulation is a new criterion."
TEST(PileAsWritten, NothingIsSteered) {
  std::vector<Vec3> centres;
  for (int i = 0; i < 12; ++i) centres.push_back(kSide * Vec3(0, 0.5 + i, 0));
  const PiledBoxes boxes(centres);
  ConstructedWorld world(boxes);
  for (uint32_t body = 1; body < world.motions.size(); ++body) {
    world.rest(body, body - 1, kSide / 2);
    world.motions[body].linear_velocity = {0.3, 0, 0};
  }
  ReposeDirector director(boxes.scene, boxes.model);
  world.step(director, 100);
  EXPECT_TRUE(world.velocity_asked.empty());
  EXPECT_EQ(std::ranges::count(world.friction, world.friction[1]),
            static_cast<std::ptrdiff_t>(world.friction.size()));
}

}  // namespace
}  // namespace pilesim
