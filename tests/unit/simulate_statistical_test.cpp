// The statistical mode: bounces, rest, piles, hard starts and bad input.

#include <gmock/gmock.h>

#include <cmath>

#include "core/error.h"
#include "signature/signature_fitting.h"
#include "support/mesh_grid.h"
#include "support/statistical_scene.h"

namespace pilesim {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;
using Statistical = test::StatisticalScene;

TEST_F(Statistical, AFlightIsAParabola) {
  add_shape("box", box_mesh({0.2, 0.1, 0.3}));
  add_body("box", {0, 100, 0}).linear_velocity = {3, 2, 0};
  start();
  run(60);
  EXPECT_NEAR(states().position[0].x(), 3, 1e-4);
  EXPECT_NEAR(states().position[0].y(), 102 - 9.81 / 2, 1e-3);
}

// However large the rotation in a step.
TEST_F(Statistical, AFlightTurnsByItsSpin) {
  add_shape("box", box_mesh({0.2, 0.1, 0.3}));
  for (const double turn : {0.01, 0.3, 0.9, 1.1, 2.5}) {  // rad a step
    scene_.bodies.clear();
    const Vec3 axis = Vec3(1, -2, 3).normalized();
    add_body("box", {0, 100, 0}).angular_velocity = turn / scene_.actual_step_s() * axis;
    start();
    const int steps = static_cast<int>(run(1).steps);
    run(39);
    const Quat expected(Eigen::AngleAxisd(40 * steps * turn, axis));
    EXPECT_LT(states().orientation[0].angularDistance(expected), 1e-3) << turn;
  }
}

// A long body that spins about its axis has little energy; one that tumbles has much.
TEST_F(Statistical, SpinsHaveTheEnergyOfTheBody) {
  const Vec3 size(0.04, 0.6, 0.04);
  add_shape("pole", box_mesh(size));
  const double mass = 1000 * size.prod();
  for (const Vec3& axis : {Vec3(0, 1, 0), Vec3(1, 0, 0)}) {
    scene_.bodies.clear();
    add_body("pole", {0, 100, 0}).angular_velocity = 6 * axis;
    scene_.gravity = Vec3::Zero();
    start();
    const double moment =
        axis.y() > 0 ? mass * 2 * 0.04 * 0.04 / 12 : mass * (0.04 * 0.04 + 0.6 * 0.6) / 12;
    const double expected = 0.5 * moment * 36;
    EXPECT_NEAR(run(30).kinetic_energy_j, expected, 1e-3 * expected) << axis.transpose();
    EXPECT_NEAR(states().angular_velocity[0].norm(), 6, 1e-3);
  }
}

// The signature gives the share of a sampled rebound from a surface that is kept.
TEST_F(Statistical, AReboundFromASurfaceFollowsTheSignature) {
  constexpr double kRadius = 0.1;
  scene_.materials["stuff"].restitution = 0.8;
  add_ground();
  add_shape("ball", sphere_mesh(kRadius, 4), 0.8);
  add_body("ball", {0, kRadius + 1, 0});
  const auto fastest_up = [&](double rebound) {
    change_packing("ball", [&](Packing& packing) { packing.rebound = rebound; });
    start();
    double fastest = 0;
    for (int frame = 0; frame < 45; ++frame) {
      run(1);
      fastest = std::max(fastest, states().linear_velocity[1].y());
    }
    return fastest;
  };
  const double whole = fastest_up(1);
  EXPECT_GT(whole, 3);
  EXPECT_NEAR(fastest_up(0.5) / whole, 0.5, 0.05);
}

// The signature of a ball has no spread: Newton's restitution.
TEST_F(Statistical, ABallBouncesToRestitutionSquaredOfItsHeight) {
  constexpr double kRadius = 0.1, kBounce = 0.8;
  scene_.materials["stuff"].restitution = kBounce;
  scene_.step_s = 1.0 / 240;
  scene_.frame_rate = 240;
  add_ground();
  add_shape("ball", sphere_mesh(kRadius, 4), kBounce);
  add_body("ball", {0, kRadius + 1, 0});
  start();
  double highest = 0;
  bool rising = false;
  for (int i = 0; i < 400; ++i) {
    run(1);
    rising = rising || states().linear_velocity[1].y() > 1;
    if (rising) highest = std::max(highest, states().position[1].y() - kRadius);
    if (rising && states().linear_velocity[1].y() < 0) break;
  }
  EXPECT_NEAR(highest, kBounce * kBounce, 0.02);
}

TEST_F(Statistical, BodiesOnLevelGroundEndInARestPose) {
  const Vec3 size(0.3, 0.2, 0.1);
  add_ground();
  add_shape("box", box_mesh(size));
  add_grid("box", {6, 1, 6}, {1, 1, 1}, {0, 0.6, 0});
  start();
  const FrameStatistics end = run(360);
  EXPECT_EQ(end.bodies_awake, 0U);
  for (size_t i = 1; i < states().size(); ++i) {
    const Vec3 up = states().orientation[i].conjugate() * Vec3::UnitY();
    Eigen::Index axis = 0;
    EXPECT_NEAR(up.cwiseAbs().maxCoeff(&axis), 1, 1e-5) << i;
    EXPECT_NEAR(states().position[i].y(), size(axis) / 2, 1e-3) << i;
  }
}

// It slides until it has the belt's speed, after v / (mu g).
TEST_F(Statistical, ABeltCarriesABody) {
  constexpr double kSpeed = 2;
  add_shape("box", box_mesh({0.2, 0.1, 0.3}));
  add_ground();
  scene_.bodies.back().surface_velocity = SurfaceVelocity{.linear = {kSpeed, 0, 0}};
  add_body("box", {0, 0.05, 0});
  start();
  run(180);
  EXPECT_NEAR(states().linear_velocity[1].x(), kSpeed, 0.02 * kSpeed);
  const double moved = kSpeed * (3 - kSpeed / (kFriction * 9.81) / 2);
  EXPECT_NEAR(states().position[1].x(), moved, 0.1 * moved);
  EXPECT_NEAR(states().position[1].z(), 0, 0.05 * moved);
}

TEST_F(Statistical, BodiesOnABeltEndInARestPose) {
  const Vec3 size(0.3, 0.2, 0.1);
  add_ground();
  scene_.bodies.back().surface_velocity = SurfaceVelocity{.linear = {1.5, 0, 0}};
  add_shape("box", box_mesh(size));
  add_grid("box", {6, 1, 6}, {1, 1, 1}, {0, 0.6, 0});
  start();
  run(360);
  for (size_t i = 1; i < states().size(); ++i) {
    const Vec3 up = states().orientation[i].conjugate() * Vec3::UnitY();
    Eigen::Index axis = 0;
    EXPECT_NEAR(up.cwiseAbs().maxCoeff(&axis), 1, 1e-4) << i;
    EXPECT_NEAR(states().position[i].y(), size(axis) / 2, 2e-3) << i;
    EXPECT_NEAR(states().linear_velocity[i].x(), 1.5, 0.05) << i;
  }
}

// On a slope, too: face to face with it.
TEST_F(Statistical, BodiesOnASlopeLieOnIt) {
  const Quat slope(Eigen::AngleAxisd(radians(12), Vec3::UnitZ()));
  add_ground();
  scene_.bodies.back().pose.orientation = slope;
  add_shape("box", box_mesh({0.3, 0.2, 0.1}));
  add_grid("box", {1, 1, 32}, {1, 1, 3}, {0, 1.2, 0});  // none leans on another
  start();
  EXPECT_EQ(run(600).bodies_awake, 0U);
  for (size_t i = 1; i < states().size(); ++i) {
    const Vec3 up = states().orientation[i].conjugate() * (slope * Vec3::UnitY());
    EXPECT_NEAR(up.cwiseAbs().maxCoeff(), 1, 1e-5) << i;
  }
}

// A pole that spins on its tip, or rolls over it too slowly, falls over.
TEST_F(Statistical, ABodyThatCannotRollOverItsTipFallsOver) {
  add_ground();
  add_shape("pole", box_mesh({0.04, 0.6, 0.04}));
  add_body("pole", {0, 0.3, 0}).angular_velocity = {0, 6, 0};
  Body& leaning = add_body("pole", {5, 0.3, 0});
  leaning.pose.orientation = Quat(Eigen::AngleAxisd(0.2, Vec3::UnitZ()));
  leaning.linear_velocity = {0.5, 0, 0};
  leaning.angular_velocity = {0, 0, -1.5};
  start();
  run(360);
  EXPECT_NEAR(states().position[1].y(), 0.02, 1e-3);
  EXPECT_NEAR(states().position[2].y(), 0.02, 1e-3);
}

// Down a slope a ball gains 5/7 of the speed of frictionless sliding.
TEST_F(Statistical, ABallRollsDownASlope) {
  const double slope = radians(10);
  add_ground();
  scene_.bodies.back().pose.orientation = Quat(Eigen::AngleAxisd(slope, Vec3::UnitZ()));
  add_shape("ball", sphere_mesh(0.1, 4));
  add_body("ball", {0, 0.1 / std::cos(slope), 0});
  start();
  run(120);
  const double way = std::hypot(states().position[1].x(), states().position[1].y());
  EXPECT_NEAR(way / (5.0 / 7 * 9.81 * std::sin(slope) * 2 * 2 / 2), 1, 0.1);
}

// Where two floors adjoin, a body rests as on one.
TEST_F(Statistical, OnTheSeamOfTwoFloorsBodiesEndInARestPose) {
  scene_.shapes["floor"] = BoxShape{{4, 1, 4}};
  for (const double side : {-2.0, 2.0}) {
    scene_.bodies.push_back({.name = side < 0 ? "left" : "right",
                             .shape = "floor",
                             .material = "stuff",
                             .role = Role::fixed});
    scene_.bodies.back().pose.position = {side, -0.5, 0};
  }
  add_shape("box", box_mesh({0.3, 0.2, 0.1}));
  add_grid("box", {1, 1, 6}, {1, 1, 0.6}, {0, 0.6, 0});
  start();
  EXPECT_EQ(run(360).bodies_awake, 0U);
  for (size_t i = 2; i < states().size(); ++i) {
    const Vec3 up = states().orientation[i].conjugate() * Vec3::UnitY();
    EXPECT_NEAR(up.cwiseAbs().maxCoeff(), 1, 1e-5) << i;
  }
}

// A body pressed against a wall turns to lie against it, at the signature's rate.
TEST_F(Statistical, ABodyThatLeansOnAWallTurnsToIt) {
  const auto mean_tilt = [&](double leaning) {
    change_packing("box", [&](Packing& packing) { packing.leaning = leaning; });
    start();
    run(480);
    double sum = 0, count = 0;
    for (size_t i = 1; i < states().size(); ++i) {
      const Vec3& at = states().position[i];
      // At one wall only, and above the floor.
      const double beside = std::max(std::abs(at.x()), std::abs(at.z()));
      if (beside < 0.28 || std::min(std::abs(at.x()), std::abs(at.z())) > 0.24) continue;
      if (at.y() < 0.3) continue;
      const Vec3 wall = std::abs(at.x()) > std::abs(at.z()) ? Vec3::UnitX() : Vec3::UnitZ();
      const Vec3 there = states().orientation[i].conjugate() * wall;
      sum += degrees(std::acos(std::min(1.0, there.cwiseAbs().maxCoeff())));
      ++count;
    }
    EXPECT_GE(count, 8);
    return sum / count;
  };
  scene_.shapes["bin"] = BinShape{{0.8, 3, 0.8}, 0.05};
  scene_.bodies.push_back(
      {.name = "bin", .shape = "bin", .material = "stuff", .role = Role::fixed});
  add_shape("box", box_mesh(Vec3::Constant(0.16)));
  add_grid("box", {2, 30, 2}, {0.35, 0.3, 0.35}, {0, 5, 0});
  EXPECT_LT(mean_tilt(0.2), 0.8 * mean_tilt(0));
}

// By as much as its signature says, and before the heap is at rest.
TEST_F(Statistical, ImpactsTurnPlatesLevel) {
  const auto mean_tilt = [&](double turning) {
    change_packing("plate", [&](Packing& packing) { packing.turning = turning; });
    start();
    run(90);
    double sum = 0;
    for (size_t i = 1; i < states().size(); ++i) {
      const Vec3 up = states().orientation[i].conjugate() * Vec3::UnitY();
      sum += degrees(std::acos(std::min(1.0, std::abs(up.y()))));
    }
    return sum / static_cast<double>(states().size() - 1);
  };
  add_ground();
  add_shape("plate", box_mesh({0.3, 0.04, 0.3}));
  add_grid("plate", {5, 5, 5}, {0.45, 0.45, 0.45}, {0, 1.3, 0});
  EXPECT_GT(mean_tilt(0.01), 35);
  EXPECT_LT(mean_tilt(3), 20);
}

// Slowly, at 0.03 of that rate, for bodies on others.
TEST_F(Statistical, ABodyOnOthersContinuesToTurn) {
  add_ground();
  add_shape("slab", box_mesh({1, 0.2, 1}));
  add_shape("plate", box_mesh({0.2, 0.05, 0.2}));
  change_packing("plate", [](Packing& packing) { packing.turning = 10; });
  add_body("slab", {0, 0.1, 0});
  Body& plate = add_body("plate", {0, 0.3, 0});
  plate.pose.orientation = Quat(Eigen::AngleAxisd(0.3, Vec3::UnitZ()));
  start();
  run(10);
  const auto tilt = [&] {
    const Vec3 up = states().orientation[2].conjugate() * Vec3::UnitY();
    return std::acos(std::min(1.0, std::abs(up.y())));
  };
  const double before = tilt();
  run(6);
  const double rate = 0.3 * std::sqrt(9.81 / std::hypot(0.1, 0.1, 0.025));
  EXPECT_NEAR(std::log(before / tilt()) / 0.1, rate, 0.05 * rate);
}

// Plates in a stack are as close as they are thick, and side by side as they are wide.
TEST_F(Statistical, PlatesLieCloserAboveEachOtherThanBesideEachOther) {
  add_ground();
  add_shape("plate", box_mesh({0.4, 0.05, 0.4}));
  add_body("plate", {0, 0.025, 0});
  add_body("plate", {0.02, 0.12, 0.01});
  add_body("plate", {3, 0.025, 0});
  add_body("plate", {3.25, 0.025, 0});
  start();
  EXPECT_EQ(run(240).bodies_awake, 0U);
  const double above = states().position[2].y() - states().position[1].y();
  const double beside = (states().position[4] - states().position[3]).norm();
  EXPECT_LT(above, 0.12);
  EXPECT_GT(beside, 0.3);
}

// Independent of its radius among other bodies.
TEST_F(Statistical, SurfacesAreMetByWhatABodyReaches) {
  add_shape("ball", sphere_mesh(0.1, 4));
  change_packing("ball", [](Packing& packing) { packing.radius_m = 0.08; });
  // Two planes form a trough for the ball: its distance from them, m.
  const auto distance_m = [&](double slope) {
    scene_.bodies.clear();
    for (const double side : {-slope, slope}) {
      scene_.bodies.push_back({.name = side < 0 ? "left" : "right",
                               .shape = "ground",
                               .material = "stuff",
                               .role = Role::fixed});
      scene_.bodies.back().pose.orientation = Quat(Eigen::AngleAxisd(side, Vec3::UnitZ()));
    }
    add_body("ball", {0, 0.5, 0});
    start();
    EXPECT_EQ(run(300).bodies_awake, 0U);
    return states().position[2].y() * std::cos(slope);
  };
  EXPECT_NEAR(distance_m(radians(30)), 0.1, 0.002);
  EXPECT_NEAR(distance_m(radians(60)), 0.1, 0.002);
}

// A heap in a bin: no drawn corner is inside its floor or walls.
TEST_F(Statistical, AtRestNothingReachesThroughAWall) {
  const Vec3 size(0.3, 0.12, 0.06);
  constexpr double kInside = 0.8, kFloor = 0.05;
  scene_.shapes["bin"] = BinShape{{kInside, 1.5, kInside}, kFloor};
  scene_.bodies.push_back(
      {.name = "bin", .shape = "bin", .material = "stuff", .role = Role::fixed});
  add_shape("plank", box_mesh(size));
  add_grid("plank", {2, 20, 2}, {0.35, 0.35, 0.35}, {0, 4, 0});
  start();
  EXPECT_EQ(run(600).bodies_awake, 0U);
  const double most = 0.02 * size.norm();
  int beside_walls = 0;
  for (size_t i = 1; i < states().size(); ++i) {
    double lowest = 1, across = 0;
    for (const Vec3& corner : box_mesh(size).vertices) {
      const Vec3 at = states().position[i] + states().orientation[i] * corner;
      lowest = std::min(lowest, at.y());
      across = std::max({across, std::abs(at.x()), std::abs(at.z())});
    }
    EXPECT_GE(lowest, kFloor - most) << i;
    EXPECT_LE(across, kInside / 2 + most) << i;
    beside_walls += across > kInside / 2 - most ? 1 : 0;
  }
  EXPECT_GE(beside_walls, 10);
}

// The centre of such a thin body is soon on the other side of a floor.
TEST_F(Statistical, NeedlesStayAboveTheFloorOfABin) {
  constexpr double kFloor = 0.05;
  scene_.shapes["bin"] = BinShape{{1.6, 3, 1.6}, kFloor};
  scene_.bodies.push_back(
      {.name = "bin", .shape = "bin", .material = "stuff", .role = Role::fixed});
  add_shape("needle", box_mesh({0.4, 0.007, 0.007}));
  change_packing("needle", [](Packing& packing) {  // about as measured
    packing.rolling = 0.003;
    packing.turning = 10;
  });
  add_grid("needle", {3, 23, 3}, {0.42, 0.42, 0.42}, {0, 5.3, 0});
  start();
  run(360);
  int below = 0;
  for (size_t i = 1; i < states().size(); ++i) {
    below += states().position[i].y() < kFloor ? 1 : 0;
  }
  EXPECT_LE(below, 1) << "of " << states().size() - 1;
}

// Where the nearest point of a hill need not be the first contact of a long body.
TEST_F(Statistical, AtRestNothingReachesIntoHills) {
  constexpr uint32_t kCells = 80;
  const auto height_m = [](const Vec3& at) {
    return 0.15 * std::sin(3 * at.x()) * std::cos(3 * at.z());
  };
  TriangleMesh hills;
  add_mesh_grid({-3, 0, -3}, {0, 0, 6}, {6, 0, 0}, kCells, hills);
  for (Vec3& v : hills.vertices) v.y() = height_m(v);
  write_obj(hills, directory_ / "hills.obj");
  scene_.shapes["hills"] =
      MeshShape{.file = directory_ / "hills.obj", .collision = CollisionKind::mesh};
  scene_.bodies.push_back(
      {.name = "hills", .shape = "hills", .material = "stuff", .role = Role::fixed});
  const Vec3 size(0.3, 0.04, 0.12);
  add_shape("plank", box_mesh(size));
  add_grid("plank", {8, 1, 8}, {0.6, 1, 0.6}, {0, 0.6, 0});
  start();
  run(420);
  int on_hills = 0;
  for (size_t i = 1; i < states().size(); ++i) {
    double deepest_m = 0;
    for (const Vec3& corner : box_mesh(size).vertices) {
      for (const double share : {0.0, 0.5, 1.0}) {  // along the plank
        const Vec3 own(share * corner.x(), corner.y(), corner.z());
        const Vec3 at = states().position[i] + states().orientation[i] * own;
        if (std::max(std::abs(at.x()), std::abs(at.z())) > 2.9) continue;
        deepest_m = std::max(deepest_m, height_m(at) - at.y());
      }
    }
    EXPECT_LT(deepest_m, 0.02 * size.norm()) << i;
    on_hills += states().position[i].y() > -1 ? 1 : 0;
  }
  EXPECT_GE(on_hills, 60);
}

TEST_F(Statistical, ASignatureThatDoesNotSayHowItsObjectPacksIsRefused) {
  add_shape("ball", sphere_mesh(0.1));
  add_body("ball", {0, 1, 0});
  const auto& file = *std::get<MeshShape>(scene_.shapes["ball"]).signature;
  Signature signature = read_signature(file);
  signature.packing.reset();
  write_signature(signature, file);
  try {
    start();
    FAIL() << "was taken";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::input);
    EXPECT_THAT(error.what(),
                HasSubstr("a signature that does not say how its object packs; expected one "
                          "with a packing (pilesim inspect shows it), made without --pours 0. "
                          "Leave \"signature\" out, or measure it again: pilesim "
                          "sample-signature --scene {file} --shape ball -o " +
                          file.string() + " --force"));
  }
}

TEST_F(Statistical, WithoutRestControlBodiesStopAsTheyAre) {
  scene_.simulator.rest_control = false;
  add_ground();
  add_shape("box", box_mesh({0.3, 0.2, 0.1}));
  add_grid("box", {6, 1, 6}, {1, 1, 1}, {0, 0.6, 0});
  scene_.emitters[0].angular_velocity_jitter = 3;
  start();
  EXPECT_EQ(run(360).bodies_awake, 0U);
  int tilted = 0;
  for (size_t i = 1; i < states().size(); ++i) {
    const Vec3 up = states().orientation[i].conjugate() * Vec3::UnitY();
    tilted += up.cwiseAbs().maxCoeff() < 0.99 ? 1 : 0;
  }
  EXPECT_GT(tilted, 18);
}

// A tilted cube that slides on a floor at this speed in sqrt(g r): its rotation towards a face in a
// tenth of a second, rad.
TEST_F(Statistical, ABodySlowerThanTwoFifthsOfAFallIsTurned) {
  const auto turned_rad = [&](double speed) {
    scene_.bodies.clear();
    const double speed_m_s = speed * std::sqrt(9.81 * 0.1 * std::sqrt(3));
    scene_.bodies.push_back({.name = "floor", .shape = "floor", .material = "ice"});
    scene_.bodies.back().role = Role::fixed;
    Body& cube = add_body("cube", {0, 0.216, 0});
    cube.pose.orientation = Quat(Eigen::AngleAxisd(0.4, Vec3::UnitZ()));
    cube.linear_velocity = {speed_m_s, 0, 0};
    start();
    run(6);
    const Vec3 up = states().orientation[1].conjugate() * Vec3::UnitY();
    return 0.4 - std::acos(std::min(1.0, up.cwiseAbs().maxCoeff()));
  };
  add_shape("cube", box_mesh(Vec3::Constant(0.2)));
  scene_.materials["ice"].friction = 0;
  scene_.shapes["floor"] = BoxShape{{20, 0.2, 20}};
  EXPECT_GT(turned_rad(0.33), 0.02);
  EXPECT_LT(turned_rad(0.5), 0.001);
}

// The same on moving and fixed ground.
TEST_F(Statistical, ALoadedBodyDoesNotTipOver) {
  add_shape("cube", box_mesh(Vec3::Constant(0.2)));
  change_packing("cube", [](Packing& packing) { packing.turning = 0; });
  scene_.shapes["floor"] = BoxShape{{20, 0.2, 20}};
  const auto turned_rad = [&](bool carries) {
    scene_.bodies.clear();
    scene_.bodies.push_back(
        {.name = "floor", .shape = "floor", .material = "stuff", .role = Role::kinematic});
    Pose end;
    end.position = {1, 0, 0};
    scene_.bodies.back().motion = {{0, {}}, {10, end}};
    add_body("cube", {0, 0.22, 0}).pose.orientation = Quat(Eigen::AngleAxisd(0.4, Vec3::UnitZ()));
    if (carries) add_body("cube", {0, 0.45, 0});
    start();
    run(6);
    const Vec3 up = states().orientation[1].conjugate() * Vec3::UnitY();
    return 0.4 - std::acos(std::min(1.0, up.cwiseAbs().maxCoeff()));
  };
  EXPECT_GT(turned_rad(false), 0.06);
  EXPECT_LT(std::abs(turned_rad(true)), 0.03);
}

TEST_F(Statistical, AFittedSignatureServesAsWell) {
  add_ground();
  add_shape("box", box_mesh({0.3, 0.2, 0.1}));
  const auto& file = *std::get<MeshShape>(scene_.shapes["box"]).signature;
  add_grid("box", {4, 2, 4}, {0.5, 0.4, 0.5}, {0, 0.8, 0});
  start();
  EXPECT_THAT(simulator_->signatures(), ElementsAre(StartsWith("box: box.sig, tables, 6 ex")));
  write_signature(fitted_signature(read_signature(file), {}), file);
  start();
  EXPECT_THAT(simulator_->signatures(), ElementsAre(StartsWith("box: box.sig, fitted splines")));
  const double before = simulator_->statistics().potential_energy_j;
  EXPECT_GT(run(20).kinetic_energy_j, 0);
  const FrameStatistics end = run(400);
  EXPECT_EQ(end.bodies_awake, 0U);
  EXPECT_LT(end.potential_energy_j, before);
  for (size_t i = 1; i < states().size(); ++i) EXPECT_GT(states().position[i].y(), 0.049) << i;
}

TEST_F(Statistical, APileStandsAndSleeps) {
  add_ground();
  add_shape("box", box_mesh(Vec3::Constant(0.2)));
  add_grid("box", {5, 5, 5}, {0.3, 0.3, 0.3}, {0, 0.9, 0});
  start();
  const FrameStatistics end = run(480);
  EXPECT_EQ(end.bodies_awake, 0U);
  EXPECT_EQ(end.kinetic_energy_j, 0);
  double mean = 0;
  for (size_t i = 1; i < states().size(); ++i) {
    EXPECT_GT(states().position[i].y(), 0.099) << i;
    mean += states().position[i].y() / 125;
  }
  // One layer is at 0.1, where a heap that sinks into itself would end.
  EXPECT_GT(mean, 0.14);
}

// The boxes on the ground that others keep from their pose: their mean distance from it.
TEST_F(Statistical, ABodyUnderOthersTurnsTowardsAPose) {
  add_ground();
  add_shape("box", box_mesh(Vec3::Constant(0.2)));
  add_grid("box", {8, 6, 8}, {0.3, 0.3, 0.3}, {0, 1.1, 0});
  scene_.emitters[0].angular_velocity_jitter = 5;
  const auto mean_tilt = [&] {
    start();
    run(360);
    double sum = 0, count = 0;
    for (size_t i = 1; i < states().size(); ++i) {
      const Vec3 up = states().orientation[i].conjugate() * Vec3::UnitY();
      const double tilt = degrees(std::acos(std::min(1.0, up.cwiseAbs().maxCoeff())));
      if (states().position[i].y() > 0.16 || tilt < 1) continue;
      sum += tilt;
      ++count;
    }
    return sum / count;
  };
  const double rocking = mean_tilt();
  scene_.simulator.rest_control = false;
  EXPECT_LT(rocking, 0.65 * mean_tilt());
}

// How much of it one body moves is chance: use the mean of five.
TEST_F(Statistical, AHeapThatSleepsIsKnockedOver) {
  add_ground();
  add_shape("box", box_mesh(Vec3::Constant(0.2)));
  Body& late = add_body("box", {0, 200, 0});
  late.linear_velocity = {0, -5, 0};
  add_grid("box", {5, 5, 5}, {0.3, 0.3, 0.3}, {0, 0.9, 0});
  const auto heap_speed = [&] {
    double sum = 0;
    for (size_t i = 2; i < states().size(); ++i) sum += states().linear_velocity[i].norm();
    return sum;
  };
  double knocked = 0;
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    scene_.seed = seed;
    start();
    int frame = 0;
    while (states().position[1].y() > 3) {
      ASSERT_LT(++frame, 500);
      run(1);
    }
    // The falling one keeps the others waiting, asleep.
    EXPECT_EQ(simulator_->statistics().bodies_awake, 1U);
    EXPECT_EQ(heap_speed(), 0);
    const double before = states().linear_velocity[1].norm();
    run(4);
    knocked += heap_speed() / before / 5;
    EXPECT_GT(simulator_->statistics().bodies_awake, 10U);
    EXPECT_LT(simulator_->statistics().kinetic_energy_j, 0.5 * 8 * before * before * 1.1);
    EXPECT_EQ(run(400).bodies_awake, 0U);
    for (size_t i = 1; i < states().size(); ++i) EXPECT_GT(states().position[i].y(), 0.099) << i;
  }
  EXPECT_GT(knocked, 0.2);
}

// Down a slope too steep for rolling: g (sin - mu cos). On a great ball, rolling resistance
// increases friction; a smooth surface does not. Uses balls, so that they stay in contact while
// they turn.
TEST_F(Statistical, RollingResistanceIncreasesFrictionOnBodies) {
  constexpr double kRolling = 0.3, kRadius = 0.1, kHill = 20;
  const double slope = radians(80), gravity = 9.81, seconds = 0.25;
  scene_.step_s = 1.0 / 60;
  add_ground();
  add_shape("ball", sphere_mesh(kRadius, 4));
  add_shape("burr", sphere_mesh(kRadius, 4));
  add_shape("hill", sphere_mesh(kHill, 4));
  const auto packing_of = [&](const std::string& shape) {
    return *read_signature(*std::get<MeshShape>(scene_.shapes[shape]).signature).packing;
  };
  change_packing("burr", [](Packing& packing) { packing.rolling = kRolling; });
  // Speeds of the ball and the burr, m/s.
  const auto speeds = [&](const Vec3& at, const Vec3& other) {
    add_body("ball", at);
    add_body("burr", other);
    start();
    run(static_cast<int>(std::lround(seconds * scene_.frame_rate)));
    const size_t count = scene_.bodies.size();
    scene_.bodies.resize(count - 2);
    return std::array{states().linear_velocity[count - 2].norm(),
                      states().linear_velocity[count - 1].norm()};
  };
  const auto expected = [&](double friction) {
    return gravity * seconds * (std::sin(slope) - friction * std::cos(slope));
  };
  const Quat turn(Eigen::AngleAxisd(slope, Vec3::UnitZ()));
  const Vec3 up = turn * Vec3::UnitY();
  scene_.bodies[0].pose.orientation = turn;
  const auto on_surface = speeds(kRadius * up, kRadius * up + Vec3(0, 0, 2));
  EXPECT_NEAR(on_surface[0], expected(kFriction), 0.005);
  EXPECT_NEAR(on_surface[1], expected(kFriction), 0.005);

  scene_.bodies[0].pose.orientation = Quat::Identity();
  const Vec3 middle(0, kHill, 0);
  add_body("hill", middle);
  const double apart = packing_of("hill").radius_m + packing_of("ball").radius_m;
  const auto on_body = speeds(middle + apart * up, middle + apart * Vec3(-up.x(), up.y(), 0));
  EXPECT_NEAR(on_body[0], expected(kFriction), 0.02);  // it becomes steeper on the way
  EXPECT_NEAR(on_body[0] - on_body[1],
              expected(kFriction) - expected(kFriction * (1 + 4 * kRolling / 7)), 0.005);
}

TEST_F(Statistical, SleepersWakeWhenTheyAreHitOrLoseTheirGround) {
  scene_.shapes["slab"] = BoxShape{{2, 0.2, 2}};
  Body slab{.name = "slab", .shape = "slab", .material = "stuff", .role = Role::fixed};
  slab.pose.position = {0, 1, 0};
  scene_.bodies.push_back(slab);
  add_shape("box", box_mesh(Vec3::Constant(0.2)));
  add_body("box", {0, 1.3, 0});
  scene_.events.push_back({4, RemoveEvent{{"slab"}}});
  start();
  EXPECT_EQ(run(230).bodies_awake, 0U);
  EXPECT_NEAR(states().position[1].y(), 1.2, 5e-3);
  run(60);
  EXPECT_LT(states().position[1].y(), 0);
}

TEST_F(Statistical, ABodyComesDownWhenItsSupportIsRemoved) {
  add_ground();
  add_shape("box", box_mesh(Vec3::Constant(0.2)));
  const std::string lower = add_body("box", {0, 0.1, 0}).name;
  add_body("box", {0, 0.35, 0});
  scene_.events.push_back({4, RemoveEvent{{lower}}});
  start();
  EXPECT_EQ(run(230).bodies_awake, 0U);
  const double before = states().position[2].y();
  EXPECT_GT(before, 0.15);
  run(90);
  EXPECT_NEAR(states().position[2].y(), 0.1, 2e-3);
}

TEST_F(Statistical, ABodyComesDownWhenItsSupportIsPushedAway) {
  add_ground();
  add_shape("box", box_mesh(Vec3::Constant(0.2)));
  const std::string lower = add_body("box", {0, 0.1, 0}).name;
  add_body("box", {0, 0.35, 0});
  scene_.events.push_back({4, ImpulseEvent{{lower}, {24, 0, 0}, Vec3::Zero()}});
  start();
  EXPECT_EQ(run(230).bodies_awake, 0U);
  EXPECT_GT(states().position[2].y(), 0.15);
  EXPECT_EQ(run(120).bodies_awake, 0U);
  EXPECT_GT(states().position[1].x(), 0.3);
  EXPECT_NEAR(states().position[2].y(), 0.1, 2e-3);
}

// An impulse p at the arm r of a body of mass m and gyration k: v = p / m, w = r x p / (m k^2).
TEST_F(Statistical, AnImpulsePushesAndTurns) {
  scene_.gravity = Vec3::Zero();
  add_shape("box", box_mesh({0.3, 0.2, 0.1}));
  const std::string box = add_body("box", Vec3::Zero()).name;
  const Vec3 impulse(0, 6, 0), arm(0.15, 0, 0);
  scene_.events.push_back({0.1, ImpulseEvent{{box}, impulse, arm}});
  start();
  run(30);
  const double mass = 1000 * 0.3 * 0.2 * 0.1;
  const double gyration2 = (0.3 * 0.3 + 0.2 * 0.2 + 0.1 * 0.1) / 18;
  EXPECT_LT((states().linear_velocity[0] - impulse / mass).norm(), 1e-5);
  EXPECT_LT((states().angular_velocity[0] - arm.cross(impulse) / (mass * gyration2)).norm(), 1e-3);
}

TEST_F(Statistical, FreeBodiesKeepTheirMomentumAndGainNoEnergy) {
  scene_.gravity = Vec3::Zero();
  add_shape("box", box_mesh({0.3, 0.2, 0.1}));
  add_grid("box", {4, 4, 4}, {0.4, 0.4, 0.4}, Vec3::Zero());
  scene_.emitters[0].linear_velocity_jitter = 3;
  scene_.emitters[0].angular_velocity_jitter = 10;
  start();
  const auto momentum = [&] {
    Vec3 sum = Vec3::Zero();
    for (const Vec3& v : states().linear_velocity) sum += v;
    return sum;
  };
  const Vec3 before = momentum();
  double energy = simulator_->statistics().kinetic_energy_j;
  const double first = energy;
  for (int i = 0; i < 120; ++i) {
    const double now = run(1).kinetic_energy_j;
    EXPECT_LE(now, energy * (1 + 1e-5)) << i;
    energy = now;
  }
  EXPECT_LT(energy, 0.9 * first);  // they did collide
  EXPECT_LT((momentum() - before).norm(), 1e-3);
}

TEST_F(Statistical, HardStartsStayFinite) {
  add_ground();
  add_shape("box", box_mesh({0.3, 0.2, 0.1}));
  add_shape("boulder", box_mesh({30, 20, 10}));
  for (int i = 0; i < 40; ++i) add_body("box", {0, 1, 0});  // all in one place
  add_body("box", {5, 1, 0}).linear_velocity = {-1000, 0, 0};
  add_body("box", {0, 50, 0}).linear_velocity = {0, -1000, 0};
  add_body("boulder", {40, 20, 0});
  start();
  run(300);  // throws when a state is no longer finite
  for (size_t i = 1; i < states().size(); ++i) EXPECT_GT(states().position[i].y(), -0.01) << i;
}

TEST_F(Statistical, ABodyWithoutSignatureIsAnError) {
  scene_.shapes["bare/~"] = BoxShape{Vec3::Ones()};
  add_body("bare/~", Vec3::Zero());
  try {
    start();
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::input);
    EXPECT_THAT(error.what(), HasSubstr("/shapes/bare~1~0: "));
    EXPECT_THAT(error.what(), HasSubstr("sample-signature"));
  }
}

TEST_F(Statistical, ASignatureOfAnotherMeshOrMaterialIsAnError) {
  add_shape("box", box_mesh(Vec3::Ones()));
  add_shape("brick", box_mesh({1, 2, 4}));
  add_body("box", Vec3::Zero());
  const auto message = [&] {
    try {
      start();
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  auto& box = std::get<MeshShape>(scene_.shapes["box"]);
  const auto right = box.signature;
  box.signature = std::get<MeshShape>(scene_.shapes["brick"]).signature;
  EXPECT_THAT(message(), HasSubstr("another mesh"));
  box.signature = right;
  EXPECT_EQ(message(), "");
  box.signature = directory_ / "missing.sig";
  EXPECT_THAT(message(), HasSubstr("measured when it is needed"));
  EXPECT_THAT(message(), HasSubstr("missing.sig\", which does not exist"));
  box.signature = right;
  scene_.materials["stuff"].restitution = 0.7;
  EXPECT_THAT(message(), HasSubstr("restitution"));
}

TEST_F(Statistical, AHingeIsAnError) {
  add_shape("box", box_mesh(Vec3::Ones()));
  add_body("box", Vec3::Zero()).hinge = Hinge{};
  EXPECT_THROW(start(), Error);
}

}  // namespace
}  // namespace pilesim
