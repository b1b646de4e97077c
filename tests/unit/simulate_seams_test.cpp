// Static bodies flush against each other form one surface, and stay solid elsewhere.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "inspect/pile_inspection.h"
#include "simulate/modes/make_simulator.h"
#include "simulate/simulator.h"
#include "support/mesh_grid.h"
#include "support/small_model.h"

namespace pilesim {
namespace {

constexpr double kSize = 0.2;  // m, of moving bodies
constexpr double kLevel = 1e-4 * kSize;
constexpr double kSpeeds[] = {0.3, 1, 5, 20};

Quat about(const Vec3& axis, double degrees) {
  return Quat(Eigen::AngleAxisd(radians(degrees), axis.normalized()));
}

// A frictionless model.
struct Smooth : SmallModel {
  Smooth() : smooth(material(0, 0)) { scene.frame_rate = 240; }

  // Its top at y = `top`.
  void block(const Vec3& size, double x, double z, double top = 0) {
    body(box(size), smooth, {x, top - size.y() / 2, z}, Role::fixed);
  }

  uint32_t triangles(TriangleMesh mesh, bool solid_behind) {
    const uint32_t index = box(mesh.bounds().sizes());
    ModelShape& shape = model.shapes[index];
    shape.mesh = std::move(mesh);
    shape.collides_as_mesh = true;
    shape.solid_behind = solid_behind;
    shape.pieces.clear();
    return index;
  }

  // Boxes, by centres and sizes, as one body.
  uint32_t compound(const std::vector<std::pair<Vec3, Vec3>>& boxes) {
    const uint32_t index = box(Vec3::Constant(kSize));
    ModelShape& shape = model.shapes[index];
    shape.pieces.clear();
    for (const auto& [centre, size] : boxes) {
      shape.pieces.push_back({CollisionPiece::Kind::box, {centre, Quat::Identity()}, size, {}});
      shape.bounding_radius = std::max(shape.bounding_radius, centre.norm() + size.norm() / 2);
    }
    return index;
  }

  uint32_t smooth;
};

// About the origin, of `cells` x `cells` squares a side.
TriangleMesh closed_box(const Vec3& size, int cells) {
  TriangleMesh mesh;
  const Vec3 x(size.x(), 0, 0), y(0, size.y(), 0), z(0, 0, size.z()), low = -size / 2;
  add_mesh_grid(low, z, y, cells, mesh);
  add_mesh_grid(low + x, y, z, cells, mesh);
  add_mesh_grid(low, x, z, cells, mesh);
  add_mesh_grid(low + y, z, x, cells, mesh);
  add_mesh_grid(low, y, x, cells, mesh);
  add_mesh_grid(low + z, x, y, cells, mesh);
  return mesh;
}

// A moving body, and the height of its centre above its support.
struct Mover {
  const char* name;
  std::function<uint32_t(Smooth&)> shape;
  Quat turn = Quat::Identity();
  double height = kSize / 2;
};

std::vector<Mover> movers() {
  return {
      {"box",
       [](Smooth& m) {
         return m.box({1.5 * kSize, kSize, kSize});
       },
       about({0, 1, 0}, 17)},
      {"ball", [](Smooth& m) { return m.sphere(kSize / 2); }},
      {"cylinder", [](Smooth& m) { return m.cylinder(kSize / 2, kSize); }, about({1, 0, 0}, 90)},
      {"disc", [](Smooth& m) { return m.cylinder(kSize / 2, 0.2 * kSize); }, Quat::Identity(),
       0.1 * kSize},
      {"chair", [](Smooth& m) {
         return m.compound({{{0, 0.25 * kSize, 0}, {kSize, 0.5 * kSize, kSize}},
                            {{-0.4 * kSize, -0.25 * kSize, 0}, {0.2 * kSize, 0.5 * kSize, kSize}},
                            {{0.4 * kSize, -0.25 * kSize, 0}, {0.2 * kSize, 0.5 * kSize, kSize}}});
       }}};
}

// The bodies made by `lay`, rotated, and a body that crosses them from `start` as on one surface.
void expect_level(const std::function<void(Smooth&)>& lay, const Vec3& start, const Vec3& way,
                  const Quat& tilt = Quat::Identity(), double speed_error = 1e-4) {
  for (const Mover& mover : movers()) {
    for (const double speed : kSpeeds) {
      SCOPED_TRACE(std::string(mover.name) + " at " + std::to_string(speed) + " m/s");
      Smooth m;
      lay(m);
      m.body(mover.shape(m), m.smooth, start + mover.height * Vec3::UnitY());
      m.model.bodies.back().pose.orientation = mover.turn;
      const Vec3 velocity = speed * way.normalized();
      m.model.bodies.back().linear_velocity = velocity;
      for (ModelBody& body : m.model.bodies) {
        body.pose.position = tilt * body.pose.position;
        body.pose.orientation = tilt * body.pose.orientation;
        body.linear_velocity = tilt * body.linear_velocity;
      }
      const auto simulator = make_simulator(m.scene, m.model);
      const double time_s = way.norm() / speed;
      const int frames = static_cast<int>(std::min(time_s, 1.5) * m.scene.frame_rate);
      const size_t last = m.model.bodies.size() - 1;
      double t = 0;
      for (int frame = 0; frame < frames; ++frame) {
        simulator->step_frame();
        t += 1 / m.scene.frame_rate;
        const BodyStates& states = simulator->states();
        const Vec3 at = tilt.conjugate() * Vec3(states.position[last]);
        ASSERT_NEAR(at.y(), mover.height, kLevel) << at.transpose();
      }
      Vec3 along = tilt.conjugate() * m.scene.gravity;
      along.y() = 0;
      const Vec3 is = tilt.conjugate() * Vec3(simulator->states().linear_velocity[last]);
      EXPECT_LT((is - velocity - t * along).norm(), speed_error * (speed + t * along.norm()));
    }
  }
}

void lay_two(Smooth& m) {
  m.block({2, 2, 2}, 0, 0);
  m.block({2, 2, 2}, 2, 0);
}

void lay_tiles(Smooth& m) {
  for (int i = 0; i < 36; ++i) m.block({1, 0.5, 1}, i % 6 - 2, i / 6 - 2);
}

TEST(Seams, BetweenCubesAreNotFelt) { expect_level(lay_two, {0, 0, 0.03}, {2, 0, 0}); }

TEST(Seams, AcrossTilesAreNotFelt) { expect_level(lay_tiles, {0, 0, 0}, {3, 0, 2.5}); }

// Where the speed changes, single precision rounds it in each substep, also on one surface.
TEST(Seams, OfATiltedFloorAreNotFelt) {
  expect_level(lay_tiles, {0, 0, 0}, {2, 0, 1.5}, about({1, 0.3, 2}, 12), 3e-4);
}

TEST(Seams, InTheMiddleOfAFaceAreNotFelt) {
  expect_level(
      [](Smooth& m) {
        m.block({2, 2, 2}, 0, 0);
        for (const double z : {-0.75, 0.25, 1.25}) m.block({1, 0.7, 1}, 1.5, z);
        m.block({2, 2, 2}, 3, 0.1);
      },
      {0, 0, 0}, {3, 0, 0.3});
}

TEST(Seams, OfOneCompoundAreNotFelt) {
  for (const Role role : {Role::fixed, Role::kinematic}) {
    expect_level(
        [role](Smooth& m) {
          m.body(m.compound({{{0, -1, 0}, {2, 2, 2}}, {{2, -0.5, 0}, {2, 1, 3}}}), m.smooth,
                 Vec3::Zero(), role);
        },
        {0, 0, 0.03}, {2, 0, 0});
  }
}

TEST(Seams, BetweenPiecesThatOverlapAreNotFelt) {
  expect_level(
      [](Smooth& m) {
        m.block({2, 2, 2}, 0, 0);
        m.block({2, 2, 2}, 1.7, 0.3);
      },
      {0, 0, 0}, {2, 0, 0.2});
}

TEST(Seams, OfAPlaneAreNotFelt) {
  expect_level(
      [](Smooth& m) {
        m.body(m.plane(), m.smooth, Vec3::Zero(), Role::fixed);
        m.block({1, 1, 1}, 1, 0);
      },
      {0, 0, 0.03}, {2, 0, 0});
}

// Two height fields, and one with a tile beside it.
TEST(Seams, OfTerrainAreNotFelt) {
  for (const bool with_tile : {false, true}) {
    for (const bool solid : {false, true}) {
      expect_level(
          [with_tile, solid](Smooth& m) {
            TriangleMesh field;
            add_mesh_grid({-1, 0, -1}, {0, 0, 2}, {2, 0, 0}, 5, field);
            const uint32_t shape = m.triangles(field, solid);
            m.body(shape, m.smooth, Vec3::Zero(), Role::fixed);
            if (with_tile) {
              m.block({2, 1, 2}, 2, 0.1);
            } else {
              m.body(shape, m.smooth, {2, 0, 0.1}, Role::fixed);
            }
          },
          {0, 0, 0.03}, {2, 0, 0});
    }
  }
}

// Closed meshes of triangles, coarse and fine: beside each other, a box and a height field, and one
// within another.
TEST(Seams, OfClosedMeshesAreNotFelt) {
  for (const int cells : {1, 4}) {
    for (const char* beside : {"mesh", "box", "field", "other size", "overlapping"}) {
      SCOPED_TRACE(std::string(beside) + " of " + std::to_string(cells));
      const std::string with = beside;
      expect_level(
          [cells, with](Smooth& m) {
            const uint32_t cube = m.triangles(closed_box({2, 2, 2}, cells), false);
            m.body(cube, m.smooth, {0, -1, 0}, Role::fixed);
            if (with == "mesh") {
              m.body(cube, m.smooth, {2, -1, 0.1}, Role::fixed);
            } else if (with == "box") {
              m.block({2, 2, 2}, 2, 0.1);
            } else if (with == "field") {
              TriangleMesh field;
              add_mesh_grid({-1, 0, -1}, {0, 0, 2}, {2, 0, 0}, 5, field);
              m.body(m.triangles(field, true), m.smooth, {2, 0, 0.1}, Role::fixed);
            } else if (with == "other size") {
              const uint32_t lower = m.triangles(closed_box({2, 1, 3}, cells), false);
              m.body(lower, m.smooth, {2, -0.5, 0.1}, Role::fixed);
            } else {
              m.body(cube, m.smooth, {1.7, -1, 0.3}, Role::fixed);
            }
          },
          {0, 0, 0.03}, {2, 0, 0});
    }
  }
}

// Meshes and boxes in turn, as thick as what crosses them, and thinner.
TEST(Seams, OfThinTilesOfTwoKindsAreNotFelt) {
  for (const double thick : {kSize, 0.5 * kSize}) {
    SCOPED_TRACE(thick);
    expect_level(
        [thick](Smooth& m) {
          const uint32_t tile = m.triangles(closed_box({0.5, thick, 0.5}, 1), false);
          for (int i = 0; i < 35; ++i) {
            const Vec3 at(0.5 * (i % 7 - 1), -thick / 2, 0.5 * (i / 7 - 2));
            if (i % 2 == 0) {
              m.body(tile, m.smooth, at, Role::fixed);
            } else {
              m.block({0.5, thick, 0.5}, at.x(), at.z());
            }
          }
        },
        {0, 0, 0.04}, {2, 0, 0});
  }
}

// Wheels roll over them as over one surface.
TEST(Seams, RollingBodiesKeepTheirSpeed) {
  for (const auto& [is_ball, is_mesh] :
       {std::pair(true, false), {false, false}, {true, true}, {false, true}}) {
    for (const double speed : kSpeeds) {
      Smooth m;
      const uint32_t rough = m.material(0, 0.5);
      const uint32_t cube = m.triangles(closed_box({1, 1, 2}, 2), false);
      for (const double x : {0.0, 1.0, 2.0}) {
        if (is_mesh) {
          m.body(cube, m.smooth, {x, -0.5, 0}, Role::fixed);
        } else {
          m.block({1, 1, 2}, x, 0);
        }
      }
      for (ModelBody& body : m.model.bodies) body.material = rough;
      const uint32_t shape = is_ball ? m.sphere(kSize / 2) : m.cylinder(kSize / 2, 0.4 * kSize);
      ModelBody& body = m.body(shape, rough, {0, kSize / 2, 0.03});
      if (!is_ball) body.pose.orientation = about({1, 0, 0}, 90);
      body.linear_velocity = {speed, 0, 0};
      body.angular_velocity = {0, 0, -2 * speed / kSize};
      const auto simulator = make_simulator(m.scene, m.model);
      const int frames = static_cast<int>(std::min(2 / speed, 1.5) * m.scene.frame_rate);
      for (int frame = 0; frame < frames; ++frame) {
        simulator->step_frame();
        ASSERT_NEAR(simulator->states().position[3].y(), kSize / 2, kLevel) << is_ball << speed;
      }
      EXPECT_NEAR(simulator->states().linear_velocity[3].x(), speed, 1e-3 * speed) << is_ball;
    }
  }
}

// Even a tiny step stops a box.
TEST(Seams, AStepStaysAStep) {
  for (const double step : {0.001, 0.01, 0.1}) {
    for (const double speed : {0.3, 1.0, 5.0}) {
      Smooth m;
      m.block({2, 2, 2}, 0, 0);
      m.block({2, 2, 2}, 2, 0, step);
      m.body(m.box({1.5 * kSize, kSize, kSize}), m.smooth, {0, kSize / 2, 0.03}).linear_velocity = {
          speed, 0, 0};
      const auto simulator = make_simulator(m.scene, m.model);
      for (int frame = 0; frame < 240 / speed + 60; ++frame) simulator->step_frame();
      if (step < 0.02 && speed > 20 * step + 0.5) continue;  // it may jump over that
      EXPECT_LT(simulator->states().position[2].x(), 1 - 0.74 * kSize) << step << ' ' << speed;
    }
  }
}

// Floor and wall both hold: a wall on the floor, and one beside it that rises.
TEST(Seams, WallAndFloorBothHold) {
  for (const bool is_beside : {false, true}) {
    for (const double speed : {0.3, 5.0, 20.0}) {
      for (const double tilt : {0.0, 10.0, 30.0}) {
        Smooth m;
        m.block({4, 2, 4}, 0, 0);
        if (is_beside) {
          m.block({1, 3, 4}, 2.5, 0, 1);
        } else {
          m.block({1, 1, 4}, 1.5, 0, 1);
        }
        const double wall = is_beside ? 2 : 1;
        ModelBody& body = m.body(m.box({1.5 * kSize, kSize, kSize}), m.smooth,
                                 {0.4, kSize * (tilt > 0 ? 0.9 : 0.5), 0.03});
        body.pose.orientation = about({0.2, 0.1, 1}, tilt);
        body.linear_velocity = {speed, -2, 0};
        const auto simulator = make_simulator(m.scene, m.model);
        double deepest = 0;
        for (int frame = 0; frame < 240; ++frame) {
          simulator->step_frame();
          const PileQuality quality = inspect_pile(m.model, m.scene.gravity, simulator->states());
          deepest = std::max(deepest, quality.deepest_penetration_m);
        }
        EXPECT_LT(deepest, (speed > 10 ? 0.25 : 0.05) * kSize)
            << is_beside << ' ' << speed << ' ' << tilt;
        EXPECT_LT(simulator->states().position[2].x(), wall) << speed << ' ' << tilt;
      }
    }
  }
}

// A body that falls on a seam, slowly or fast, by a corner or flat, rests on the floor.
TEST(Seams, ABodyThatFallsOnASeamRestsOnIt) {
  for (const double speed : {0.0, 10.0}) {
    for (int i = 0; i < 6; ++i) {
      Smooth m;
      const uint32_t rough = m.material(0, 0.5);
      lay_tiles(m);
      ModelBody& body =
          m.body(m.box({1.5 * kSize, kSize, kSize}), rough, {0.5 + 0.02 * i, 0.6, 0.5 + 0.03 * i});
      body.pose.orientation = about({1, 0.2 * i, 0.5}, 25 * i);
      body.linear_velocity = {0.1 * speed, -speed, 0};
      const auto simulator = make_simulator(m.scene, m.model);
      for (int frame = 0; frame < 300; ++frame) simulator->step_frame();
      const PileQuality quality = inspect_pile(m.model, m.scene.gravity, simulator->states());
      EXPECT_LT(quality.deepest_penetration_m, 2e-3 * kSize) << speed << ' ' << i;
      EXPECT_GT(simulator->states().position[36].y(), 0.49 * kSize) << speed << ' ' << i;
    }
  }
}

// Down a slope of a box onto a level box that begins at its foot: as onto a plane.
TEST(Seams, AValleyHoldsWhatComesDown) {
  constexpr double kThick = 0.1;
  for (const double slope : {1.0, 5.0, 11.0, 22.5, 35.0}) {
    for (const bool is_round : {false, true}) {
      std::array<double, 2> way{};
      for (const bool is_plane : {false, true}) {
        Smooth m;
        const uint32_t stuff = is_round ? m.material(0, 0.5) : m.smooth;
        const Quat tilt = about({0, 0, 1}, -slope);
        // Its top ends at the origin.
        m.body(m.box({2, kThick, 2}), stuff, tilt * Vec3(-1, -kThick / 2, 0), Role::fixed)
            .pose.orientation = tilt;
        if (is_plane) {
          m.body(m.plane(), stuff, Vec3::Zero(), Role::fixed);
        } else {
          m.body(m.box({6, kThick, 2}), stuff, {3, -kThick / 2, 0}, Role::fixed);
        }
        const uint32_t shape = is_round ? m.sphere(kSize / 2) : m.box(Vec3::Constant(kSize));
        ModelBody& body = m.body(shape, stuff, tilt * Vec3(-0.6, kSize / 2, 0));
        body.pose.orientation = tilt;
        body.linear_velocity = tilt * Vec3(1, 0, 0);
        const auto simulator = make_simulator(m.scene, m.model);
        double lowest = 1;
        for (int frame = 0; frame < 240; ++frame) {
          simulator->step_frame();
          lowest = std::min(lowest, simulator->states().position[2].y());
        }
        EXPECT_GT(lowest, 0.495 * kSize) << slope << ' ' << is_round << ' ' << is_plane;
        way[is_plane ? 1 : 0] = simulator->states().position[2].x();
      }
      EXPECT_NEAR(way[0], way[1], 0.01 * way[1]) << slope << ' ' << is_round;
    }
  }
}

// Balls in a ring of pieces stay in it.
TEST(Seams, ARingOfPiecesHoldsBalls) {
  constexpr int kPieces = 16;
  constexpr double kRadius = 0.5, kWall = 0.1;
  for (int i = 0; i < 12; ++i) {
    Smooth m;
    const uint32_t stave = m.box({2 * (kRadius + kWall) * std::tan(kPi / kPieces), kWall, 1});
    for (int k = 0; k < kPieces; ++k) {
      const Quat turn = about({0, 0, 1}, 360.0 * k / kPieces);
      m.body(stave, m.smooth, turn * Vec3(0, kRadius + kWall / 2, 0), Role::fixed)
          .pose.orientation = turn;
    }
    m.body(m.sphere(0.1), m.material(0, 0.5), {0.06 * i - 0.33, 0.01 * i, 0});
    const auto simulator = make_simulator(m.scene, m.model);
    for (int frame = 0; frame < 360; ++frame) simulator->step_frame();
    const Vec3 at = simulator->states().position[kPieces];
    EXPECT_LT(std::hypot(at.x(), at.y()), kRadius) << i;
  }
}

// It falls over the outer edge of a table, also where a seam ends there.
TEST(Seams, OuterEdgesStayEdges) {
  Smooth m;
  lay_two(m);
  ModelBody& body = m.body(m.box(Vec3::Constant(kSize)), m.smooth, {0.5, kSize / 2, 0.95});
  body.linear_velocity = {0.8, 0, 0.2};
  const auto simulator = make_simulator(m.scene, m.model);
  double deepest = 0;
  for (int frame = 0; frame < 240; ++frame) {
    simulator->step_frame();
    const PileQuality quality = inspect_pile(m.model, m.scene.gravity, simulator->states());
    deepest = std::max(deepest, quality.deepest_penetration_m);
  }
  EXPECT_LT(simulator->states().position[2].y(), -0.5);
  EXPECT_LT(deepest, 2e-3 * kSize);
}

}  // namespace
}  // namespace pilesim
