// Impacts: centred ones are symmetric, and impulses travel through rows.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "core/philox.h"
#include "simulate/modes/make_simulator.h"
#include "support/small_model.h"
#include "support/small_simulation.h"

namespace pilesim {
namespace {

// A heavy body falls on a light cube on the ground, or on a plate on two cubes, all centred.
struct HeavyImpact {
  std::string heavy;  // or "plate"
  double ratio, restitution;
  int step_hz;
  int others = 0;  // bodies elsewhere
};

struct Outcome {
  double tilt_deg = 0, sideways_m = 0;  // largest of any body
  double height_m = 0;                  // of the heavy one at the end, above its resting height
};

constexpr double kEdge = 0.5;  // m

SmallModel model_of(const HeavyImpact& impact) {
  constexpr double kDrop = 0.5;  // m
  SmallModel m;
  m.scene.step_s = 1.0 / impact.step_hz;
  m.body(m.plane(), m.material(impact.restitution, 0.5), Vec3::Zero(), Role::fixed);
  const Quat turn(Eigen::AngleAxisd(kPi / 6, Vec3::UnitY()));
  const auto put = [&](uint32_t shape, double mass_kg, const Vec3& place) {
    const double density = mass_kg / m.model.shapes[shape].mass.volume_m3;
    m.body(shape, m.material(impact.restitution, 0.5, density), Vec3(1.37, 0, 0.29) + turn * place)
        .pose.orientation = turn;
  };
  double top = kEdge, half = kEdge / 2;
  uint32_t heavy = 0;
  if (impact.heavy == "plate") {
    const uint32_t support = m.box(Vec3::Constant(0.3));
    for (const double x : {-0.6, 0.6}) put(support, 1, {x, 0.15, 0});
    put(m.box({1.5, 0.1, 0.4}), 1, {0, 0.35, 0});
    top = 0.4;
    heavy = m.box(Vec3::Constant(kEdge));
  } else {
    put(m.box(Vec3::Constant(kEdge)), 1, {0, kEdge / 2, 0});
    if (impact.heavy == "box") heavy = m.box(Vec3::Constant(kEdge));
    if (impact.heavy == "ball") heavy = m.sphere(kEdge / 2);
    if (impact.heavy == "cylinder") {
      heavy = m.cylinder(kEdge / 2, 1);
      half = 0.5;
    }
    if (impact.heavy == "hull") {  // a prism with seven sides
      std::vector<Vec3> points;
      half = 0.4;
      for (int k = 0; k < 7; ++k) {
        const double angle = 2 * kPi * k / 7;
        for (const double y : {-half, half}) {
          points.push_back({0.22 * std::cos(angle), y, 0.22 * std::sin(angle)});
        }
      }
      heavy = m.hull(points);
    }
  }
  put(heavy, impact.ratio, {0, top + half + kDrop, 0});
  const uint32_t other = m.box(Vec3::Constant(0.2)), stuff = m.material(impact.restitution, 0.5);
  for (int i = 0; i < impact.others; ++i) {
    m.body(other, stuff, {5 + 0.25 * (i % 10), 0.3 + 0.25 * (i / 100), 0.25 * (i / 10 % 10)});
  }
  return m;
}

Outcome outcome_of(const HeavyImpact& impact) {
  const SmallModel m = model_of(impact);
  const size_t count = m.model.bodies.size() - static_cast<size_t>(impact.others);
  const auto simulator = make_simulator(m.scene, m.model);
  Outcome outcome;
  for (int frame = 0; frame < 75; ++frame) {
    simulator->step_frame();
    const BodyStates& states = simulator->states();
    for (size_t i = 1; i < count; ++i) {
      const Vec3 up = states.orientation[i] * Vec3::UnitY();
      const double tilt = 180 / kPi * std::asin(std::min(1.0, std::hypot(up.x(), up.z())));
      const bool rolls = impact.heavy == "ball" && i + 1 == count;
      if (!rolls) outcome.tilt_deg = std::max(outcome.tilt_deg, tilt);
      const Vec3 drift = states.position[i] - m.model.bodies[i].pose.position;
      outcome.sideways_m = std::max(outcome.sideways_m, std::hypot(drift.x(), drift.z()));
    }
  }
  const double start = m.model.bodies[count - 1].pose.position.y();
  outcome.height_m = simulator->states().position[count - 1].y() - (start - 0.5);
  return outcome;
}

void expect_symmetric(const HeavyImpact& impact) {
  const Outcome outcome = outcome_of(impact);
  SCOPED_TRACE(impact.heavy + " of " + std::to_string(impact.ratio) + " kg, restitution " +
               std::to_string(impact.restitution) + ", 1/" + std::to_string(impact.step_hz) + " s");
  EXPECT_LT(outcome.tilt_deg, 2);
  EXPECT_LT(outcome.sideways_m, 0.1 * kEdge);
  EXPECT_NEAR(outcome.height_m, 0, 0.02 * kEdge);
}

TEST(Impacts, ACentredOneOfAHeavyBodyIsSymmetric) {
  for (const int step_hz : {60, 240}) {
    for (const double restitution : {0.0, 0.3}) {
      for (const char* heavy : {"cylinder", "box", "ball", "hull", "plate"}) {
        for (const double ratio : {1.0, 10.0, 60.0, 100.0}) {
          expect_symmetric({heavy, ratio, restitution, step_hz});
        }
      }
    }
  }
}

// Distant events change nothing.
TEST(Impacts, ACentredOneIsSymmetricBesideManyBodies) {
  for (const char* heavy : {"cylinder", "box"}) {
    for (const double ratio : {10.0, 60.0}) expect_symmetric({heavy, ratio, 0, 240, 200});
  }
}

// Bodies in a row along x.
struct Row {
  std::vector<double> masses_kg, speeds_m_s, gaps_m;
  double restitution;
  int step_hz;
  bool boxes = false;
};

constexpr double kRadius = 0.02, kApart = 0.0401;  // m

// m/s, after all collisions.
std::vector<double> speeds_after(const Row& row) {
  SmallModel m;
  m.scene.gravity = Vec3::Zero();
  m.scene.step_s = 1.0 / row.step_hz;
  const uint32_t shape = row.boxes ? m.box(Vec3::Constant(2 * kRadius)) : m.sphere(kRadius);
  const double volume = m.model.shapes[shape].mass.volume_m3;
  double x = 0;
  for (size_t i = 0; i < row.masses_kg.size(); ++i) {
    if (i > 0) x += 2 * kRadius + row.gaps_m[i - 1];
    const uint32_t material = m.material(row.restitution, 0, row.masses_kg[i] / volume);
    m.body(shape, material, {x, 0, 0}).linear_velocity = {row.speeds_m_s[i], 0, 0};
  }
  const auto simulator = make_simulator(m.scene, m.model);
  run(*simulator, 30);
  std::vector<double> speeds;
  for (const Vec3& velocity : simulator->states().linear_velocity) speeds.push_back(velocity.x());
  return speeds;
}

// The first ball stops and the last one leaves, whether they touch or a step exceeds the gaps.
TEST(Impacts, ARowPassesAnImpulseOn) {
  for (const int step_hz : {60, 240}) {
    for (const bool boxes : {false, true}) {
      for (const double gap : {0.0, 1e-6, 1e-4, 1e-3, 1e-2, kRadius}) {
        for (size_t count = 2; count <= 10; ++count) {
          std::vector<double> masses(count, 1), speeds(count, 0), gaps(count - 1, gap);
          speeds[0] = 1;
          gaps[0] = kApart;
          const std::vector<double> after = speeds_after({masses, speeds, gaps, 1, step_hz, boxes});
          for (size_t i = 0; i < count; ++i) {
            EXPECT_NEAR(after[i], i + 1 == count ? 1 : 0, 1e-3)
                << i << " of " << count << ", gap " << gap << ", 1/" << step_hz << " s";
          }
        }
      }
    }
  }
}

// Solvers leave bodies that touch with speeds by rounding, towards each other or apart: no impacts.
TEST(Impacts, ARowThatIsNotQuiteAtRestPassesAnImpulseOn) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> rounding(-1e-9, 1e-9);  // m/s
  for (int i = 0; i < 100; ++i) {
    const size_t count = 5 + i % 6;
    std::vector<double> masses(count, 1), speeds(count), gaps(count - 1, 0);
    std::ranges::generate(speeds, [&] { return rounding(random); });
    speeds[0] = 1;
    gaps[0] = 0.005;  // hit in the first step, before they have bounced apart
    EXPECT_NEAR(speeds_after({masses, speeds, gaps, 1, 60, i % 2 == 0}).back(), 1, 1e-3) << i;
  }
}

// Boxes that sleep on the ground, with gaps that a step jumps over: none is as a wall to the
// others.
TEST(Impacts, ARowThatSleepsPassesAnImpulseOn) {
  constexpr double kWidth = 0.2;
  for (const double restitution : {1.0, 0.0}) {
    for (const double speed : {0.5, 2.0, 5.0}) {
      for (const double gap : {1e-4, 0.01 * kWidth, 0.05 * kWidth}) {
        SmallModel m;
        m.scene.step_s = 1.0 / 60;
        const uint32_t slick = m.material(restitution, 0);
        m.body(m.plane(), slick, Vec3::Zero(), Role::fixed);
        const uint32_t box = m.box(Vec3::Constant(kWidth));
        for (int i = 0; i < 5; ++i) {
          // They fall asleep before they are hit.
          const double x = i * (kWidth + gap) - (i == 0 ? speed : 0);
          ModelBody& body = m.body(box, slick, {x, kWidth / 2, 0});
          if (i == 0) body.linear_velocity.x() = speed;
        }
        const auto simulator = make_simulator(m.scene, m.model);
        run(*simulator, 80);
        double sum = 0;
        for (size_t i = 1; i <= 5; ++i) sum += simulator->states().linear_velocity[i].x();
        EXPECT_NEAR(sum, speed, 0.02 * speed) << restitution << ' ' << gap << ' ' << speed;
        if (restitution < 1) continue;
        EXPECT_NEAR(simulator->states().linear_velocity[5].x(), speed, 0.05 * speed)
            << gap << ' ' << speed;
      }
    }
  }
}

// In no frame is a body of such a row in the next one.
TEST(Impacts, ARowWithGapsStaysApart) {
  constexpr double kWidth = 1;
  for (const bool boxes : {false, true}) {
    for (const double restitution : {0.0, 0.5, 1.0}) {
      for (const double gap : {0.005, 0.01, 0.02, 0.03, 0.05}) {
        SmallModel m;
        m.scene.gravity = Vec3::Zero();
        const uint32_t slick = m.material(restitution, 0);
        const uint32_t shape = boxes ? m.box(Vec3::Constant(kWidth)) : m.sphere(kWidth / 2);
        for (int i = 0; i < 6; ++i) {
          ModelBody& body = m.body(shape, slick, {i * (1 + gap) * kWidth, 0, 0});
          if (i == 0) body.linear_velocity.x() = 3;
          body.asleep = i > 0;
        }
        const auto simulator = make_simulator(m.scene, m.model);
        double overlap_m = 0;
        for (int frame = 0; frame < 20; ++frame) {
          simulator->step_frame();
          const std::vector<Vec3>& at = simulator->states().position;
          for (size_t i = 0; i + 1 < at.size(); ++i) {
            overlap_m = std::max(overlap_m, kWidth - (at[i + 1].x() - at[i].x()));
          }
        }
        EXPECT_LT(overlap_m, 0.01 * kWidth)
            << (boxes ? "boxes " : "balls ") << ", e " << restitution << ", gap " << gap;
      }
    }
  }
}

TEST(Impacts, AsManyLeaveARowAsHitIt) {
  for (const double gap : {0.0, 1e-4, 1e-2}) {
    const std::vector<double> after =
        speeds_after({{1, 1, 1, 1, 1}, {1, 1, 0, 0, 0}, {gap, kApart, gap, gap}, 1, 240});
    for (size_t i = 0; i < 5; ++i) EXPECT_NEAR(after[i], i < 3 ? 0 : 1, 1e-3) << i << " " << gap;
  }
}

// Two bodies at a time: the target takes (1 + e) m1 / (m1 + m2) of the speed.
TEST(Impacts, ARowOfUnequalBodiesCollidesTwoByTwo) {
  for (const double gap : {0.0, 1e-4, 1e-2}) {
    const std::vector<double> falling = speeds_after({{4, 2, 1}, {1, 0, 0}, {kApart, gap}, 1, 240});
    EXPECT_NEAR(falling[0], 1.0 / 3, 1e-3);
    EXPECT_NEAR(falling[1], 4.0 / 9, 1e-3);
    EXPECT_NEAR(falling[2], 16.0 / 9, 1e-3);
    const std::vector<double> rising = speeds_after({{1, 2, 4}, {1, 0, 0}, {kApart, gap}, 1, 240});
    EXPECT_NEAR(rising[0], -1.0 / 3, 1e-3);
    EXPECT_NEAR(rising[1], -2.0 / 9, 1e-3);
    EXPECT_NEAR(rising[2], 4.0 / 9, 1e-3);
    const std::vector<double> lossy =
        speeds_after({{1, 1, 1, 1}, {1, 0, 0, 0}, {kApart, gap, gap}, 0.5, 240});
    EXPECT_NEAR(lossy[3], 0.75 * 0.75 * 0.75, 1e-3);
    EXPECT_NEAR(lossy[0] + lossy[1] + lossy[2] + lossy[3], 1, 1e-6);
  }
}

// A cube that lands flat stops in place: its corners share the impact equally.
TEST(Impacts, OfAFlatFaceLeavesNoDrift) {
  for (const double step_s : {0.0, 1.0 / 60, 1.0 / 240}) {
    for (const double speed : {3.0, 7.0, 12.0, 20.0}) {
      SmallModel m;
      if (step_s > 0) m.scene.step_s = step_s;
      m.body(m.plane(), m.material(0, 0.5), Vec3::Zero(), Role::fixed);
      m.body(m.box(Vec3::Constant(2)), 0, {0, 8, 0}).linear_velocity = {0, -speed, 0};
      const auto simulator = make_simulator(m.scene, m.model);
      for (int frame = 0; frame < 90; ++frame) simulator->step_frame();
      EXPECT_LT((simulator->states().position[1] - Vec3::UnitY()).norm(), 1e-4)
          << speed << " m/s, step " << step_s;
    }
  }
}

// A body's greatest heights over the ground in the flights after its first bounces, m, from its
// energy.
std::vector<double> rebounds(const SmallModel& m, double lowest_m, size_t bounces) {
  const auto simulator = make_simulator(m.scene, m.model);
  std::vector<double> heights;
  double before = 0;
  for (int frame = 0; frame < 1200 && heights.size() < bounces; ++frame) {
    simulator->step_frame();
    const BodyStates& states = simulator->states();
    const double speed = states.linear_velocity[1].y();
    if (speed > 0 && before <= 0) {
      heights.push_back(states.position[1].y() - lowest_m + speed * speed / (2 * test::kGravity));
    }
    before = speed;
  }
  return heights;
}

// Wherever in a step the impact falls, and however long the step is.
TEST(Impacts, ABallReboundsToTheSquareOfItsRestitution) {
  for (const double restitution : {0.3, 0.5, 0.8, 1.0}) {
    for (const double height : {0.05, 0.2, 1.0, 5.0, 20.0}) {
      for (const double diameter : {0.001, 0.01, 0.1, 1.0, 10.0}) {
        SmallModel m;
        m.scene.step_s.reset();
        const uint32_t stuff = m.material(restitution, 0.3);
        m.body(m.plane(), stuff, Vec3::Zero(), Role::fixed);
        m.body(m.sphere(diameter / 2), stuff, {0, height + diameter / 2, 0});
        // A bounce that gravity ends within a step is none.
        const size_t bounces = restitution < 0.5 ? 1 : 2;
        const std::vector<double> heights = rebounds(m, diameter / 2, bounces);
        double expected = height;
        ASSERT_EQ(heights.size(), bounces) << restitution << " " << height << " " << diameter;
        for (const double reached : heights) {
          expected *= restitution * restitution;
          EXPECT_NEAR(reached / expected, 1, 0.001)
              << restitution << " " << height << " " << diameter;
        }
      }
    }
  }
}

TEST(Impacts, ABoxThatFallsFlatBouncesFlat) {
  for (const double edge : {0.01, 0.1, 1.0, 10.0}) {
    for (const double height : {0.2, 1.0, 5.0}) {
      if (height > 100 * edge) continue;
      SmallModel m;
      m.scene.step_s.reset();
      const uint32_t stuff = m.material(1, 0.3);
      m.body(m.plane(), stuff, Vec3::Zero(), Role::fixed);
      m.body(m.box(Vec3::Constant(edge)), stuff, {0, height + edge / 2, 0});
      const std::vector<double> heights = rebounds(m, edge / 2, 4);
      ASSERT_EQ(heights.size(), 4U);
      for (const double reached : heights) {
        EXPECT_NEAR(reached / height, 1, 0.005) << edge << " " << height;
      }
    }
  }
}

// A ball falls obliquely or spinning; the impulses of friction and of the ground act at its own
// surface, however far it is when the step begins.
TEST(Impacts, AnObliqueOneOfABallKeepsItsAngularMomentum) {
  constexpr double kBall = 0.05, kRestitution = 0.8;
  for (const double friction : {0.1, 1.0}) {
    for (const double drop : {0.3, 0.41, 0.5, 0.63}) {
      for (const double speed : {0.7, 1.0, 5.0}) {
        SmallModel m;
        m.scene.step_s.reset();
        const uint32_t stuff = m.material(kRestitution, friction);
        m.body(m.plane(), stuff, Vec3::Zero(), Role::fixed);
        m.body(m.sphere(kBall), stuff, {0, kBall + drop, 0}).linear_velocity.x() = speed;
        const auto simulator = make_simulator(m.scene, m.model);
        run(*simulator, static_cast<int>(60 * std::sqrt(2 * drop / test::kGravity)) + 4);
        const double impulse = (1 + kRestitution) * std::sqrt(2 * test::kGravity * drop) * friction;
        const double lost = std::min(impulse, 2 * speed / 7);  // until it rolls
        const BodyStates& states = simulator->states();
        EXPECT_NEAR(states.linear_velocity[1].x(), speed - lost, 0.003 * speed)
            << friction << ' ' << drop << ' ' << speed;
        EXPECT_NEAR(states.angular_velocity[1].z(), -2.5 * lost / kBall, 0.01 * lost / kBall)
            << friction << ' ' << drop << ' ' << speed;
      }
    }
  }
}

// One of two balls is hit off its centre: it leaves along the line of centres at the impact.
TEST(Impacts, AnObliqueOneOfBallsIsAlongTheirCentres) {
  constexpr double kBall = 0.03;
  for (const double restitution : {1.0, 0.5}) {
    for (const double speed : {0.5, 1.0, 3.0, 8.0}) {
      for (const double degrees : {10.0, 40.0, 55.0, 70.0, 80.0}) {
        const double angle = kPi / 180 * degrees;
        SmallModel m;
        m.scene.gravity.setZero();
        m.scene.step_s.reset();
        const uint32_t stuff = m.material(restitution, 0), ball = m.sphere(kBall);
        m.body(ball, stuff, {-0.1137, 0, 0}).linear_velocity.x() = speed;
        m.body(ball, stuff, {0, 2 * kBall * std::sin(angle), 0});
        const auto simulator = make_simulator(m.scene, m.model);
        run(*simulator, 30);
        const Vec3 given = (1 + restitution) / 2 * speed * std::cos(angle) *
                           Vec3(std::cos(angle), std::sin(angle), 0);
        const BodyStates& states = simulator->states();
        EXPECT_LT((states.linear_velocity[1] - given).norm(), 0.002 * speed)
            << restitution << ' ' << speed << ' ' << degrees;
        EXPECT_LT((states.linear_velocity[0] + given - Vec3(speed, 0, 0)).norm(), 0.002 * speed)
            << restitution << ' ' << speed << ' ' << degrees;
      }
    }
  }
}

// An open box of slats with gaps between them.
uint32_t crate(SmallModel& m, const Vec3& size, double thick) {
  const uint32_t index = m.box(size);
  ModelShape& shape = m.model.shapes[index];
  shape.pieces.clear();
  const auto add = [&](const Vec3& centre, const Vec3& sides) {
    shape.pieces.push_back({CollisionPiece::Kind::box, {centre, Quat::Identity()}, sides, {}});
  };
  const double wide = size.z() / 5;
  for (const double z : {-2.0, -1.0, 0.0, 1.0, 2.0}) {
    add({0, -size.y() / 2, z * wide}, {size.x(), thick, 0.8 * wide});
  }
  for (const double y : {-0.3, 0.0, 0.3}) {
    const double high = 0.2 * size.y();
    for (const double side : {-0.5, 0.5}) {
      add({side * size.x(), y * size.y(), 0}, {thick, high, size.z()});
      add({0, y * size.y(), side * size.z()}, {size.x(), high, thick});
    }
  }
  return index;
}

// Bodies that hook into each other: not all of their contacts can bounce, and they are deeper in
// each other than their walls are thick. No body becomes faster than by its fall and by the speed
// at which overlaps are undone.
TEST(Impacts, BodiesThatStartInOthersDoNotBurst) {
  Philox random(1, Stream::test, 0);
  SmallModel m;
  m.scene.step_s.reset();
  const uint32_t material = m.material(0.3, 0.5);
  m.body(m.plane(), material, Vec3::Zero(), Role::fixed);
  const uint32_t shape = crate(m, {1.1, 0.8, 0.8}, 0.02);
  constexpr double kSpacing = 0.5;
  for (int i = 0; i < 100; ++i) {
    const Vec3 place(kSpacing * (i % 5), 1 + kSpacing * (i / 25), kSpacing * (i / 5 % 5));
    m.body(shape, material, place).pose.orientation = random.rotation();
  }
  const auto simulator = make_simulator(m.scene, m.model);
  const double by_fall = std::sqrt(2 * test::kGravity * 4);
  const double by_overlaps = 5 * std::sqrt(test::kGravity);
  for (int frame = 0; frame < 100; ++frame) {
    simulator->step_frame();
    for (const Vec3& velocity : simulator->states().linear_velocity) {
      ASSERT_LT(velocity.norm(), by_fall + by_overlaps) << frame;
    }
  }
}

}  // namespace
}  // namespace pilesim
