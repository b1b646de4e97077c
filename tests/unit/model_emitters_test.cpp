#include "model/emitters.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "core/error.h"
#include "geometry/primitives.h"
#include "scene/scene_format.h"

namespace pilesim {
namespace {

constexpr uint64_t kSeed = 11;

Emitter emitter(EmitterSource source, int count = 0) {
  return {
      .name = "e", .shapes = {"a"}, .material = "m", .source = std::move(source), .count = count};
}

TEST(Emitters, GridIsCentredAndFillsFromTheBottom) {
  const auto bodies = unroll(
      emitter(GridSource{.centre = {1, 2, 3}, .count = {2, 3, 4}, .spacing = {0.1, 0.2, 0.3}}), 0,
      kSeed, 1, nullptr);
  ASSERT_EQ(bodies.size(), 24u);
  Vec3 mean = Vec3::Zero();
  Bounds bounds;
  for (size_t i = 0; i < bodies.size(); ++i) {
    mean += bodies[i].pose.position / 24;
    bounds.extend(bodies[i].pose.position);
    EXPECT_GE(bodies[i].pose.position.y(), bodies[i - std::min<size_t>(i, 1)].pose.position.y());
  }
  EXPECT_NEAR((mean - Vec3(1, 2, 3)).norm(), 0, 1e-12);
  EXPECT_NEAR((bounds.sizes() - Vec3(0.1, 0.4, 0.9)).norm(), 0, 1e-12);
  EXPECT_NEAR((bodies[1].pose.position - bodies[0].pose.position - Vec3(0.1, 0, 0)).norm(), 0,
              1e-12);
}

TEST(Emitters, DiskIsUniformInItsCylinder) {
  constexpr int kCount = 40'000;
  const auto bodies =
      unroll(emitter(DiskSource{.centre = {5, 6, 7}, .radius = 2, .height = 3}, kCount), 0, kSeed,
             0, nullptr);
  // Equal shares of 5 rings of equal area x 4 layers x 8 sectors: chi-squared with 159 degrees of
  // freedom is below 248 with probability 1 - 1e-5.
  std::array<int, 160> cells{};
  for (const EmittedBody& body : bodies) {
    const Vec3 p = body.pose.position - Vec3(5, 6, 7);
    const double ring = (p.x() * p.x() + p.z() * p.z()) / 4 * 5;
    const double layer = (p.y() / 3 + 0.5) * 4;
    const double sector = (std::atan2(p.z(), p.x()) / (2 * kPi) + 0.5) * 8;
    ASSERT_LT(ring, 5);
    ASSERT_TRUE(layer >= 0 && layer < 4);
    ++cells[static_cast<size_t>(ring) * 32 + static_cast<size_t>(layer) * 8 +
            std::min<size_t>(7, static_cast<size_t>(sector))];
  }
  double chi_squared = 0;
  for (const int count : cells) chi_squared += (count - 250.0) * (count - 250.0) / 250.0;
  EXPECT_LT(chi_squared, 248);
}

TEST(Emitters, DiskKeepsBodiesApartWhileThereIsRoom) {
  constexpr double kRadius = 0.1;
  const Emitter rain = emitter(DiskSource{.radius = 1, .height = 2}, 300);  // 20 % of the volume
  const auto bodies = unroll(rain, 0, kSeed, kRadius, nullptr);
  for (size_t i = 0; i < bodies.size(); ++i) {
    for (size_t j = 0; j < i; ++j) {
      EXPECT_GE((bodies[i].pose.position - bodies[j].pose.position).norm(), 2 * kRadius);
    }
  }
}

TEST(Emitters, AnOverfullDiskStillHasAllItsBodies) {
  const auto bodies =
      unroll(emitter(DiskSource{.radius = 0.5, .height = 0}, 200), 0, kSeed, 0.3, nullptr);
  EXPECT_EQ(bodies.size(), 200u);
}

TEST(Emitters, LineGoesToAndFro) {
  Emitter line = emitter(LineSource{.from = {0, 1, 0}, .to = {4, 1, 2}, .period_s = 2}, 9);
  line.rate_hz = 4;
  line.start_s = 1;
  const auto bodies = unroll(line, 0, kSeed, 1, nullptr);
  const std::array<double, 9> share = {0, 0.25, 0.5, 0.75, 1, 0.75, 0.5, 0.25, 0};
  for (size_t i = 0; i < 9; ++i) {
    EXPECT_NEAR((bodies[i].pose.position - (Vec3(0, 1, 0) + share[i] * Vec3(4, 0, 2))).norm(), 0,
                1e-12);
    EXPECT_DOUBLE_EQ(bodies[i].start_s, 1 + 0.25 * static_cast<double>(i));
  }
}

TEST(Emitters, StreamStartsOneByOneAndTakesShapesInTurn) {
  Emitter stream = emitter(PointSource{.position = {1, 2, 3}}, 5);
  stream.rate_hz = 10;
  stream.shapes = {"a", "b", "c"};
  stream.linear_velocity = {0, -1, 0};
  const auto bodies = unroll(stream, 0, kSeed, 1, nullptr);
  for (size_t i = 0; i < 5; ++i) {
    EXPECT_EQ(bodies[i].pose.position, Vec3(1, 2, 3));
    EXPECT_EQ(bodies[i].linear_velocity, Vec3(0, -1, 0));
    EXPECT_DOUBLE_EQ(bodies[i].start_s, 0.1 * static_cast<double>(i));
    EXPECT_EQ(bodies[i].shape, i % 3);
  }
}

TEST(Emitters, ANozzleIsWhereItsKeysPutItWhenABodyStarts) {
  PointSource nozzle{.position = {9, 9, 9}};
  nozzle.motion = {{.time_s = 1, .pose = {{0, 2, 0}, Quat::Identity()}},
                   {.time_s = 3, .pose = {{4, 2, 0}, Quat::Identity()}}};
  Emitter stream = emitter(nozzle, 9);
  stream.rate_hz = 2;
  for (const EmittedBody& body : unroll(stream, 0, kSeed, 1, nullptr)) {
    const double x = std::clamp(2 * (body.start_s - 1), 0.0, 4.0);
    EXPECT_NEAR((body.pose.position - Vec3(x, 2, 0)).norm(), 0, 1e-12) << body.start_s;
  }
}

TEST(Emitters, ANozzleTurnsWhatItLaunches) {
  // A quarter of a turn about z in a second, on a circle of 2 m.
  PointSource nozzle{.position = {2, 5, 0}};
  nozzle.motion.motors = {{.action = SpinMotor{{0, 0, kPi / 2}, {-2, 0, 0}}}};
  Emitter stream = emitter(nozzle, 5);
  stream.rate_hz = 1;
  stream.linear_velocity = {3, 0, 0};
  stream.angular_velocity = {0, 1, 0};
  stream.orientation = Quat::Identity();
  const auto bodies = unroll(stream, 0, kSeed, 1, nullptr);
  for (size_t i = 0; i < bodies.size(); ++i) {
    const Quat turn(Eigen::AngleAxisd(kPi / 2 * static_cast<double>(i), Vec3::UnitZ()));
    EXPECT_NEAR((bodies[i].pose.position - Vec3(0, 5, 0) - turn * Vec3(2, 0, 0)).norm(), 0, 1e-12);
    EXPECT_NEAR((bodies[i].linear_velocity - turn * Vec3(3, 0, 0)).norm(), 0, 1e-12);
    EXPECT_NEAR((bodies[i].angular_velocity - turn * Vec3(0, 1, 0)).norm(), 0, 1e-12);
    EXPECT_NEAR(bodies[i].pose.orientation.angularDistance(turn), 0, 1e-7);
  }
}

TEST(Emitters, OrientationsAreUniformUnlessGiven) {
  const Emitter rain = emitter(DiskSource{}, 20'000);
  Mat3 mean = Mat3::Zero();
  for (const EmittedBody& body : unroll(rain, 0, kSeed, 0, nullptr)) {
    EXPECT_NEAR(body.pose.orientation.norm(), 1, 1e-12);
    mean += body.pose.orientation.toRotationMatrix() / 20'000;
  }
  // Each entry has mean 0 and variance 1/3: six standard errors.
  EXPECT_LT(mean.cwiseAbs().maxCoeff(), 6 * std::sqrt(1.0 / 3 / 20'000));

  Emitter upright = rain;
  upright.orientation = Quat(0, 1, 0, 0);
  EXPECT_EQ(unroll(upright, 0, kSeed, 0, nullptr)[7].pose.orientation.coeffs(),
            Quat(0, 1, 0, 0).coeffs());
}

TEST(Emitters, JitterStaysInItsCubeAndBalls) {
  constexpr int kCount = 10'000;
  Emitter stream = emitter(PointSource{.position = {1, 2, 3}}, kCount);
  stream.rate_hz = 1;
  stream.position_jitter_m = 0.5;
  stream.linear_velocity = {9, 0, 0};
  stream.linear_velocity_jitter = 2;
  stream.angular_velocity_jitter = 3;
  double position_squares = 0;
  double velocity_radii = 0;
  double spin_radii = 0;
  for (const EmittedBody& body : unroll(stream, 0, kSeed, 0, nullptr)) {
    const Vec3 moved = body.pose.position - Vec3(1, 2, 3);
    const double speed = (body.linear_velocity - Vec3(9, 0, 0)).norm();
    EXPECT_LE(moved.cwiseAbs().maxCoeff(), 0.5);
    EXPECT_LE(speed, 2);
    EXPECT_LE(body.angular_velocity.norm(), 3);
    position_squares += moved.squaredNorm() / kCount;
    velocity_radii += speed / kCount;
    spin_radii += body.angular_velocity.norm() / kCount;
  }
  EXPECT_NEAR(position_squares, 3 * 0.25 / 3, 0.01);  // variance of a uniform: half width^2 / 3
  EXPECT_NEAR(velocity_radii, 2 * 0.75, 0.02);        // mean radius in a ball: 3/4
  EXPECT_NEAR(spin_radii, 3 * 0.75, 0.03);
}

TEST(Emitters, VolumeIsFilledFromTheBottomAndInside) {
  const TriangleMesh mesh = box_mesh({1, 2, 1});
  const Pose pose = {{5, 0, 0}, Quat(Eigen::AngleAxisd(kPi / 2, Vec3::UnitZ()))};
  const Emitter filled = emitter(VolumeSource{.pose = pose, .spacing = 0.15});
  const auto bodies = unroll(filled, 0, kSeed, 1, &mesh);
  ASSERT_EQ(bodies.size(), 14u * 7u * 7u);  // floor(2 / 0.15) + 1, floor(1 / 0.15) + 1
  for (size_t i = 0; i < bodies.size(); ++i) {
    const Vec3 p = bodies[i].pose.position - Vec3(5, 0, 0);
    EXPECT_TRUE(std::abs(p.x()) < 1 && std::abs(p.y()) < 0.5 && std::abs(p.z()) < 0.5);
    EXPECT_GE(p.y(), bodies[i - std::min<size_t>(i, 1)].pose.position.y());
  }
  Emitter limited = filled;
  limited.count = 100;
  const auto some = unroll(limited, 0, kSeed, 1, &mesh);
  ASSERT_EQ(some.size(), 100u);
  EXPECT_EQ(some[99].pose.position, bodies[99].pose.position);
}

TEST(Emitters, AVolumeIsNotFilledBeyondWhatASceneMayHold) {
  const TriangleMesh mesh = box_mesh({1, 1, 1});
  const Emitter overfull = emitter(VolumeSource{.spacing = 0.00765});  // 131 per side
  EXPECT_EQ(unroll(overfull, 0, kSeed, 1, &mesh).size(), static_cast<size_t>(kMostBodies) + 1);
}

TEST(Emitters, AVolumeWithFarTooSmallASpacingIsAnError) {
  const TriangleMesh mesh = box_mesh({1, 1, 1});
  EXPECT_THROW(unroll(emitter(VolumeSource{.spacing = 1e-4}), 0, kSeed, 1, &mesh), Error);
}

TEST(Emitters, EmittersAndSeedsDrawDifferentNumbers) {
  const Emitter rain = emitter(DiskSource{}, 1);
  const Vec3 first = unroll(rain, 0, kSeed, 0, nullptr)[0].pose.position;
  EXPECT_EQ(first, unroll(rain, 0, kSeed, 0, nullptr)[0].pose.position);
  EXPECT_NE(first, unroll(rain, 1, kSeed, 0, nullptr)[0].pose.position);
  EXPECT_NE(first, unroll(rain, 0, kSeed + 1, 0, nullptr)[0].pose.position);
}

}  // namespace
}  // namespace pilesim
