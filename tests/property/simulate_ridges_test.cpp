// Long thin bodies on sharp ridges and peaks, of terrain and of open meshes: they never sink in,
// and gain no energy.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "core/philox.h"
#include "inspect/pile_inspection.h"
#include "simulate/modes/make_simulator.h"
#include "support/random_vectors.h"
#include "support/small_model.h"

namespace pilesim {
namespace {

constexpr double kGroundWidth = 5, kGroundHeight = 0.5;  // m

// Heights of a square ground in rows: 13 x 13 random ones, or 19 x 19 of crossing sharp ridges.
TriangleMesh ridged_ground(bool is_random, Philox& random) {
  const uint32_t count = is_random ? 14 : 20;
  const double turn = random.uniform(0, kPi), shift_u = random.uniform(),
               shift_v = random.uniform();
  const auto ridge = [](double at) { return std::pow(std::abs(2 * (at - std::floor(at)) - 1), 3); };
  TriangleMesh mesh;
  for (uint32_t row = 0; row < count; ++row) {
    for (uint32_t column = 0; column < count; ++column) {
      const double x = column / (count - 1.0), z = row / (count - 1.0);
      const double u = std::cos(turn) * x + std::sin(turn) * z;
      const double v = std::cos(turn) * z - std::sin(turn) * x;
      const double height = is_random ? random.uniform()
                                      : 0.7 * ridge(4 * u + shift_u) + 0.3 * ridge(3 * v + shift_v);
      mesh.vertices.emplace_back((x - 0.5) * kGroundWidth, height * kGroundHeight,
                                 (z - 0.5) * kGroundWidth);
      if (row + 1 == count || column + 1 == count) continue;
      const uint32_t corner = row * count + column, below = corner + count;
      mesh.triangles.push_back({corner, below, corner + 1});
      mesh.triangles.push_back({corner + 1, below, below + 1});
    }
  }
  return mesh;
}

struct OnRidges {
  Vec3 size;  // m, of boxes
  bool is_random, is_terrain;
  double friction;
  uint64_t seed;
};

// 25 boxes fall, those of a diagonal at once, and pass through each other.
void expect_on_top(const OnRidges& scene) {
  SCOPED_TRACE(std::to_string(scene.size.x()) + " m, " + (scene.is_random ? "random" : "ridges") +
               (scene.is_terrain ? ", terrain" : ", mesh") + ", friction " +
               std::to_string(scene.friction) + ", seed " + std::to_string(scene.seed));
  constexpr int kSide = 5;
  for (int diagonal = 0; diagonal < kSide; ++diagonal) {
    Philox random(scene.seed, Stream::emitter, 0);
    SmallModel m;
    m.scene.step_s.reset();
    const uint32_t stuff = m.material(0.1, scene.friction);
    const uint32_t ground = m.box(Vec3::Constant(kGroundWidth)), box = m.box(scene.size);
    ModelShape& shape = m.model.shapes[ground];
    shape.mesh = ridged_ground(scene.is_random, random);
    shape.collides_as_mesh = true;
    shape.solid_behind = scene.is_terrain;
    shape.pieces.clear();
    m.body(ground, stuff, Vec3::Zero(), Role::fixed);
    for (int i = 0; i < kSide * kSide; ++i) {
      const Vec3 place((i % kSide - 2) * 0.8, kGroundHeight + scene.size.x() / 2 + 0.1,
                       (i / kSide - 2) * 0.8);
      const Vec3 axis = random.direction();
      const Quat turn(Eigen::AngleAxisd(random.uniform(0, kPi), axis));
      if ((i % kSide + i / kSide) % kSide != diagonal) continue;
      m.body(box, stuff, place).pose.orientation = turn;
    }
    for (uint32_t i = 1; i < m.model.bodies.size(); ++i) {
      for (uint32_t j = i + 1; j < m.model.bodies.size(); ++j) {
        m.model.kept_apart.push_back(pair_key(i, j));
      }
    }
    const auto simulator = make_simulator(m.scene, m.model);
    const double diameter = 2 * m.model.shapes[box].bounding_radius;
    const double mass = m.model.bodies.back().mass_kg;
    const Mat3 inertia = m.model.shapes[box].mass.inertia_m5 / scene.size.prod() * mass;
    std::vector<double> depths, energy(m.model.bodies.size()), before;
    double deepest = 0, gained = 0;
    for (int frame = 0; frame < 4 * m.scene.frame_rate; ++frame) {
      simulator->step_frame();
      const BodyStates& states = simulator->states();
      depths = overlap_depths(m.model, states);
      deepest = std::max(deepest, *std::ranges::max_element(depths));
      before = energy;
      double sum = 0, sum_before = 0;
      for (size_t i = 1; i < energy.size(); ++i) {
        const Vec3 spin =
            Quat(states.orientation[i]).conjugate() * Vec3(states.angular_velocity[i]);
        energy[i] = mass * (Vec3(states.linear_velocity[i]).squaredNorm() / 2 +
                            test::kGravity * states.position[i].y()) +
                    spin.dot(inertia * spin) / 2;
        sum += energy[i];
        sum_before += before[i];
      }
      if (frame > 0) gained = std::max(gained, sum - sum_before);
    }
    EXPECT_LT(*std::ranges::max_element(depths), 0.002 * diameter);
    EXPECT_LT(deepest, 0.02 * diameter);
    EXPECT_LT(gained, 0.002 * mass * test::kGravity * diameter);
  }
}

const Vec3 kBar(1, 0.025, 0.05), kSheet(0.6, 0.01, 0.6);

TEST(Ridges, HoldBars) {
  for (const uint64_t seed : {1, 2, 3}) {
    expect_on_top({kBar, false, true, 0.5, seed});
    expect_on_top({kBar, true, false, 0.5, seed});
  }
}

TEST(Ridges, HoldSheetsOnTheirPeaks) {
  for (const uint64_t seed : {1, 2, 3}) {
    for (const bool is_terrain : {false, true}) {
      expect_on_top({kSheet, true, is_terrain, 0.5, seed});
    }
  }
}

// Bars slide from slope to slope: a triangle beyond the ridge is not what they are deep in.
TEST(Ridges, HoldSlidingBars) {
  for (const uint64_t seed : {1, 2, 3}) expect_on_top({kBar, true, true, 0, seed});
}

// Half a ball, open upwards, of triangles.
TriangleMesh bowl(double radius, uint32_t rings) {
  const uint32_t sectors = 4 * rings;
  TriangleMesh mesh;
  for (uint32_t ring = 0; ring <= rings; ++ring) {
    const double polar = ring * kPi / 2 / rings;
    for (uint32_t k = 0; k < sectors; ++k) {
      const double turn = 2 * kPi * k / sectors;
      mesh.vertices.emplace_back(radius * std::sin(polar) * std::cos(turn),
                                 -radius * std::cos(polar),
                                 radius * std::sin(polar) * std::sin(turn));
      if (ring == rings) continue;
      const uint32_t at = ring * sectors + k, next = ring * sectors + (k + 1) % sectors;
      if (ring > 0) mesh.triangles.push_back({at, next, next + sectors});
      mesh.triangles.push_back({at, next + sectors, at + sectors});
    }
  }
  return mesh;
}

// It meets each slope before it is in it: what separates it again would lift it.
TEST(Ridges, ABallThatSwingsInABowlGainsNoEnergy) {
  constexpr double kBowl = 0.5, kBall = 0.05;  // m
  for (const uint32_t rings : {32, 64}) {
    for (const double friction : {0.0, 0.5}) {
      SmallModel m;
      m.scene.step_s.reset();
      const uint32_t stuff = m.material(0, friction);
      const uint32_t shell = m.box(Vec3::Constant(2 * kBowl)), ball = m.sphere(kBall);
      m.model.shapes[shell].mesh = bowl(kBowl, rings);
      m.model.shapes[shell].collides_as_mesh = true;
      m.model.shapes[shell].pieces.clear();
      m.body(shell, stuff, Vec3::Zero(), Role::fixed);
      const double start = 0.38, length = kBowl - kBall;  // rad, m
      m.body(ball, stuff, {length * std::sin(start), -length * std::cos(start) + 1e-4, 0.003});
      const auto simulator = make_simulator(m.scene, m.model);
      const double swing = length * (1 - std::cos(start));
      for (int frame = 0; frame < 300; ++frame) {
        simulator->step_frame();
        const BodyStates& states = simulator->states();
        const double energy =
            states.linear_velocity[1].squaredNorm() / 2 +
            0.2 * kBall * kBall * states.angular_velocity[1].squaredNorm() +
            test::kGravity * (states.position[1].y() - m.model.bodies[1].pose.position.y());
        EXPECT_LT(energy, 0.01 * test::kGravity * swing)
            << rings << ' ' << friction << ' ' << frame;
      }
    }
  }
}

}  // namespace
}  // namespace pilesim
