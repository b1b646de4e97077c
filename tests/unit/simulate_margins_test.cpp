// Distances of bodies from their supports: surface on surface, however large the lower one is.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "geometry/mesh_check.h"
#include "inspect/pile_inspection.h"
#include "simulate/modes/make_simulator.h"
#include "simulate/simulator.h"
#include "support/mesh_grid.h"
#include "support/small_model.h"
#include "support/small_simulation.h"

namespace pilesim {
namespace {

// The largest gap at rest, and the penetration allowed for a contact, as a share of the smaller
// body's smallest extent; a ten-thousandth more for rounding.
constexpr double kGap = 1.0001e-3;

enum class Ground { room, terrain, hulls, box };
constexpr Ground kGrounds[] = {Ground::room, Ground::terrain, Ground::hulls, Ground::box};
const char* name_of(Ground ground) {
  constexpr const char* kNames[] = {"room", "terrain", "hulls", "box"};
  return kNames[static_cast<size_t>(ground)];
}

// The inside of a cube of that edge, its floor at y = 0 about the origin.
TriangleMesh room_mesh(double size) {
  TriangleMesh mesh;
  const double half = size / 2;
  const Vec3 x(size, 0, 0), y(0, size, 0), z(0, 0, size);
  add_mesh_grid({-half, 0, -half}, z, x, 6, mesh);
  add_mesh_grid({-half, size, -half}, x, z, 1, mesh);
  add_mesh_grid({-half, 0, -half}, x, y, 1, mesh);
  add_mesh_grid({-half, 0, half}, y, x, 1, mesh);
  add_mesh_grid({-half, 0, -half}, y, z, 1, mesh);
  add_mesh_grid({half, 0, -half}, z, y, 1, mesh);
  return mesh;
}

// Hills as high as a tenth of the size, level about the origin.
TriangleMesh terrain_mesh(double size) {
  TriangleMesh mesh;
  const double half = size / 2;
  add_mesh_grid({-half, 0, -half}, {0, 0, size}, {size, 0, 0}, 16, mesh);
  for (Vec3& v : mesh.vertices) {
    const double far = std::max(std::abs(v.x()), std::abs(v.z())) / half;
    v.y() = far > 0.3 ? 0.1 * size * (far - 0.3) * (1 + std::sin(9 * v.x() / half)) : 0;
  }
  return mesh;
}

uint32_t mesh_shape(SmallModel& m, TriangleMesh mesh) {
  const uint32_t index = m.box(mesh.bounds().sizes());
  ModelShape& shape = m.model.shapes[index];
  shape.mesh = std::move(mesh);
  shape.collides_as_mesh = true;
  shape.pieces.clear();
  return index;
}

// A support for bodies about `origin`, with its surface at that height.
void add_ground(SmallModel& m, Ground ground, double size, uint32_t material, const Vec3& origin) {
  switch (ground) {
    case Ground::room:
      m.body(mesh_shape(m, room_mesh(size)), material, origin, Role::fixed);
      return;
    case Ground::terrain:
      m.body(mesh_shape(m, terrain_mesh(size)), material, origin, Role::fixed);
      return;
    case Ground::hulls: {  // two that adjoin beside the origin
      const uint32_t shape = m.box(Vec3::Constant(size));
      m.model.shapes[shape].pieces.clear();
      for (const double side : {-1.0, 1.0}) {
        TriangleMesh half = box_mesh({size / 2, size, size});
        for (Vec3& v : half.vertices) v.x() += side * size / 4;
        m.model.shapes[shape].pieces.push_back({CollisionPiece::Kind::hull, {}, {}, half});
      }
      m.body(shape, material, origin - Vec3(0.003, size / 2, 0), Role::fixed);
      return;
    }
    case Ground::box:
      m.body(m.box(Vec3::Constant(size)), material, origin - Vec3(0, size / 2, 0), Role::fixed);
  }
}

// A seat with a back, of two hulls.
uint32_t chair(SmallModel& m, double size) {
  const uint32_t index = m.box(Vec3::Constant(size));
  ModelShape& shape = m.model.shapes[index];
  shape.pieces.clear();
  MassProperties parts[2];
  const Vec3 sizes[] = {{size, 0.4 * size, size}, {0.4 * size, 0.6 * size, size}};
  const Vec3 places[] = {{0, 0.2 * size, 0}, {-0.3 * size, 0.7 * size, 0}};
  for (int i = 0; i < 2; ++i) {
    parts[i] = transformed(box_mass_properties(sizes[i]), {places[i], Quat::Identity()});
  }
  shape.mass = combine({parts[0], parts[1]});
  const Vec3 centre = shape.mass.centre_of_mass;
  shape.mass.centre_of_mass.setZero();
  shape.bounding_radius = 0;
  for (int i = 0; i < 2; ++i) {
    TriangleMesh hull = box_mesh(sizes[i]);
    for (Vec3& v : hull.vertices) {
      v += places[i] - centre;
      shape.bounding_radius = std::max(shape.bounding_radius, v.norm());
    }
    shape.pieces.push_back({CollisionPiece::Kind::hull, {}, {}, hull});
  }
  return index;
}

uint32_t pyramid(SmallModel& m, double size) {
  const double h = size / 2;
  return m.hull({{-h, 0, -h}, {h, 0, -h}, {-h, 0, h}, {h, 0, h}, {0, size, 0}});
}

// The height of a body's lowest point.
double lowest_m(const ModelShape& shape, const Pose& pose) {
  double lowest = std::numeric_limits<double>::infinity();
  for (const CollisionPiece& piece : shape.pieces) {
    const Pose placed{pose.apply(piece.pose.position), pose.orientation * piece.pose.orientation};
    switch (piece.kind) {
      case CollisionPiece::Kind::hull:
        for (const Vec3& v : piece.hull.vertices) lowest = std::min(lowest, placed.apply(v).y());
        break;
      case CollisionPiece::Kind::box:
        for (const Vec3& v : box_mesh(piece.size).vertices) {
          lowest = std::min(lowest, placed.apply(v).y());
        }
        break;
      default:
        lowest = std::min(lowest, placed.position.y() - piece.size.x());
    }
  }
  return lowest;
}

// Bodies of one size on a ground: their true gaps, independent of any collision detection.
void expect_surface_on_surface(Ground ground, double ground_m, double size, const Vec3& origin) {
  SCOPED_TRACE(std::string(name_of(ground)) + " of " + std::to_string(ground_m) + " m, bodies of " +
               std::to_string(size) + " m");
  SmallModel m;
  const uint32_t material = m.material(0, 0.6);
  add_ground(m, ground, ground_m, material, origin);
  const std::vector<uint32_t> shapes = {m.box(Vec3::Constant(size)), m.sphere(size / 2),
                                        pyramid(m, size), chair(m, size)};
  // Across edges of the ground's triangles through the origin.
  for (size_t i = 0; i < shapes.size(); ++i) {
    const ModelShape& shape = m.model.shapes[shapes[i]];
    const double reach = -lowest_m(shape, {});
    m.body(shapes[i], material,
           origin + size * Vec3(1.5 * static_cast<double>(i % 2), 0.02 + reach / size,
                                1.5 * static_cast<double>(i / 2)));
  }
  const auto simulator = make_simulator(m.scene, m.model);
  const FrameStatistics end = run(*simulator, 120);
  EXPECT_EQ(end.bodies_awake, 0);
  const BodyStates& states = simulator->states();
  for (size_t i = 1; i < states.size(); ++i) {
    const ModelShape& shape = m.model.shapes[m.model.bodies[i].shape];
    const double gap = lowest_m(shape, {states.position[i], states.orientation[i]}) - origin.y();
    EXPECT_LT(gap, kGap * shape.smallest_extent) << "body " << i;
    EXPECT_GT(gap, -kGap * shape.smallest_extent) << "body " << i;
  }
  const PileQuality quality = inspect_pile(m.model, m.scene.gravity, states);
  EXPECT_EQ(quality.floating + quality.escaped + quality.unsettled, 0);
  EXPECT_LT(quality.largest_gap_m, kGap * size);
  EXPECT_LT(quality.deepest_penetration_m, kGap * size);
}

// Extends the surface of add_grid() by walls down to a floor at `floor_m`.
void close_below(uint32_t cells, double floor_m, TriangleMesh& mesh) {
  const auto below = static_cast<uint32_t>(mesh.vertices.size());
  const auto above = mesh.triangles;
  for (uint32_t i = 0; i < below; ++i) {
    mesh.vertices.emplace_back(mesh.vertices[i].x(), floor_m, mesh.vertices[i].z());
  }
  for (const Triangle& t : above) {
    mesh.triangles.push_back({t[0] + below, t[2] + below, t[1] + below});
  }
  const auto wall = [&](uint32_t a, uint32_t b) {
    mesh.triangles.push_back({a, a + below, b});
    mesh.triangles.push_back({b, a + below, b + below});
  };
  const uint32_t row = cells + 1;
  for (uint32_t k = 0; k < cells; ++k) {
    wall(k + 1, k);
    wall(cells * row + k, cells * row + k + 1);
    wall(k * row, (k + 1) * row);
    wall((k + 1) * row + cells, k * row + cells);
  }
}

// Hills of small triangles under longer bodies: on a hilltop, the middle of a body is behind the
// planes of most faces that it may touch.
void expect_planks_on_hills(bool is_closed) {
  constexpr uint32_t kCells = 64;
  const auto height_m = [](const Vec3& at) {
    return 0.1 * std::sin(9 * at.x()) * std::sin(8 * at.z() + 1);
  };
  const Vec3 size(0.2, 0.02, 0.04);
  TriangleMesh hills;
  add_mesh_grid({-1, 0, -1}, {0, 0, 2}, {2, 0, 0}, kCells, hills);
  for (Vec3& v : hills.vertices) v.y() = height_m(v);
  if (is_closed) {
    close_below(kCells, -1, hills);
    ASSERT_TRUE(find_volume_defects(hills).empty());
  }
  SmallModel m;
  const uint32_t material = m.material(0, 0.9);
  m.body(mesh_shape(m, hills), material, Vec3::Zero(), Role::fixed);
  const uint32_t plank = m.box(size);
  for (int i = 0; i < 36; ++i) {
    const Vec3 place(0.25 * (i % 6 - 2.5), 0, 0.25 * (i / 6 - 2.5));
    m.body(plank, material, place + Vec3(0, height_m(place) + 0.15, 0));
    m.model.bodies.back().pose.orientation =
        Quat(Eigen::AngleAxisd(0.4 * i, Vec3(1, 0.3 * i, -1).normalized()));
  }
  const auto simulator = make_simulator(m.scene, m.model);
  run(*simulator, 180);
  const BodyStates& states = simulator->states();
  int above = 0;
  for (size_t i = 1; i < states.size(); ++i) {
    double deepest_m = 0;
    for (const Vec3& corner : box_mesh(size).vertices) {
      for (const double share : {0.0, 0.5, 1.0}) {  // along the plank
        const Vec3 own(share * corner.x(), corner.y(), corner.z());
        const Vec3 at = states.position[i] + states.orientation[i] * own;
        if (at.cwiseAbs().maxCoeff() < 0.95) deepest_m = std::max(deepest_m, height_m(at) - at.y());
      }
    }
    EXPECT_LT(deepest_m, 0.1 * size.y()) << i;
    above += states.position[i].cwiseAbs().maxCoeff() < 0.95 ? 1 : 0;
  }
  EXPECT_GE(above, 30);  // and have not slid off
}

// Bars, planks and sheets with thicknesses down to a hundredth of their length fall on hills flat,
// on end and turning.
void expect_thin_bodies_stay_out(bool solid_behind, const std::vector<Vec3>& sizes) {
  TriangleMesh hills;
  add_mesh_grid({-10, 0, -10}, {0, 0, 20}, {20, 0, 0}, 64, hills);
  for (Vec3& v : hills.vertices) {
    v.y() = 1.5 + 0.9 * std::sin(1.3 * v.x()) * std::cos(1.1 * v.z()) + 0.1 * std::sin(4 * v.x());
  }
  for (const Vec3& size : sizes) {
    SmallModel m;
    const uint32_t material = m.material(0.1, 0.6);
    const uint32_t ground = mesh_shape(m, hills);
    m.model.shapes[ground].solid_behind = solid_behind;
    m.body(ground, material, Vec3::Zero(), Role::fixed);
    const uint32_t shape = m.box(size);
    for (int i = 0; i < 12; ++i) {
      ModelBody& body = m.body(shape, material, {5.5 * (i % 3 - 1), 6, 4.2 * (i / 3 - 1.5)});
      const Quat turned(Eigen::AngleAxisd(0.7 * i, Vec3::UnitY()));
      if (i % 3 == 0) body.pose.orientation = turned;
      if (i % 3 == 1) {
        body.pose.orientation = turned * Quat(Eigen::AngleAxisd(1.54, Vec3::UnitZ()));
      }
      if (i % 3 == 2) {
        body.pose.orientation = Quat(Eigen::AngleAxisd(0.9 * i, Vec3(1, 0.3 * i, -1).normalized()));
        body.angular_velocity = {3, -2, 4.0 - i};
      }
    }
    const double d = 2 * m.model.shapes[shape].bounding_radius;
    const auto simulator = make_simulator(m.scene, m.model);
    double deepest_m = 0;
    for (int frame = 0; frame < 200; ++frame) {
      simulator->step_frame();
      for (const double depth : overlap_depths(m.model, simulator->states())) {
        deepest_m = std::max(deepest_m, depth);
      }
    }
    EXPECT_LT(deepest_m, 0.02 * d) << size.transpose();
    for (const double depth : overlap_depths(m.model, simulator->states())) {
      EXPECT_LT(depth, 0.002 * d) << size.transpose();
    }
    for (const Vec3& at : simulator->states().position) EXPECT_GT(at.y(), -0.1) << at.transpose();
  }
}

// It has no other side from which a hill could hold penetrating bodies.
TEST(Margins, ThinBodiesStayOutOfAHeightField) {
  expect_thin_bodies_stay_out(
      true, {{3, 0.1, 0.1}, {1, 0.03, 0.03}, {3, 0.03, 0.03}, {3, 0.05, 0.4}, {2, 0.02, 1.5}});
}

// It has two sides, and does not hold bodies that come from one of them.
TEST(Margins, ThinBodiesStayOutOfAnOpenMesh) {
  expect_thin_bodies_stay_out(false, {{1, 0.03, 0.03}, {3, 0.05, 0.4}, {2, 0.02, 1.5}});
}

TEST(Margins, LongBodiesLieOnHills) { expect_planks_on_hills(false); }
TEST(Margins, LongBodiesLieOnASolidOfHills) { expect_planks_on_hills(true); }

TEST(Margins, BodiesOfAllSizesLieOnGroundOfAllSizes) {
  for (const Ground ground : kGrounds) {
    for (const double ground_m : {1.0, 10.0, 100.0, 1000.0}) {
      for (const double size : {0.01, 0.1, 1.0}) {
        if (size > 0.05 * ground_m) continue;
        expect_surface_on_surface(ground, ground_m, size, Vec3::Zero());
      }
    }
  }
}

TEST(Margins, BodiesLieInARoomFarFromTheOrigin) {
  for (const Ground ground : kGrounds) {
    expect_surface_on_surface(ground, 40, 0.1, {8000, -3000, 5000});
  }
}

// A small body on a large one, and the reverse.
TEST(Margins, TheSmallerOfTwoBodiesTellsTheGap) {
  for (const bool hulls : {true, false}) {
    for (const bool small_below : {true, false}) {
      SmallModel m;
      const uint32_t material = m.material(0, 0.6);
      m.body(m.plane(), material, Vec3::Zero(), Role::fixed);
      const auto cube = [&](double size) {
        const uint32_t shape = m.box(Vec3::Constant(size));
        if (!hulls) return shape;
        ModelShape& s = m.model.shapes[shape];
        s.pieces = {{CollisionPiece::Kind::hull, {}, {}, s.mesh}};
        return shape;
      };
      const double low = small_below ? 0.02 : 1, high = small_below ? 1 : 0.02;
      const uint32_t lower = cube(low), upper = cube(high);
      m.model.materials.push_back({0, 0.6, 1});  // light: nothing is pressed in
      m.body(lower, material, {0, low / 2, 0}, small_below ? Role::fixed : Role::dynamic);
      m.body(upper, material + 1, {0, low + high / 2 + 1e-3, 0});
      const auto simulator = make_simulator(m.scene, m.model);
      run(*simulator, 240);
      const auto& position = simulator->states().position;
      const double gap = position[2].y() - position[1].y() - (low + high) / 2;
      EXPECT_LT(gap, kGap * 0.02) << hulls << small_below;
      EXPECT_GT(gap, -kGap * 0.02) << hulls << small_below;
      EXPECT_NEAR(position[1].y(), low / 2, kGap * low) << hulls << small_below;
      const PileQuality quality = inspect_pile(m.model, m.scene.gravity, simulator->states());
      EXPECT_EQ(quality.floating, 0);
      EXPECT_NEAR(quality.largest_gap_m, std::max(gap, 0.0), kGap * 0.02);
    }
  }
}

// Over the edge of a thin slab of triangles, down to the ground: nothing hangs on the edge.
TEST(Margins, ABodyThatTipsOverAnEdgeFalls) {
  for (int i = 0; i < 20; ++i) {
    SmallModel m;
    const uint32_t wood = m.material(0.1, 0.3);
    m.body(m.plane(), wood, Vec3::Zero(), Role::fixed);
    const uint32_t slab = m.box({1, 0.04, 1});
    m.model.shapes[slab].pieces.clear();
    m.model.shapes[slab].collides_as_mesh = true;
    m.body(slab, wood, {0, 1, 0}, Role::fixed);
    const uint32_t shape = m.box(i % 2 == 0 ? Vec3(0.3, 0.1, 0.2) : Vec3(0.4, 0.05, 0.05));
    ModelBody& body = m.body(shape, wood, {0.2, 1.2, 0.1});
    body.pose.orientation = Quat(Eigen::AngleAxisd(0.3 * i, Vec3(1, 0.3, 0.5).normalized()));
    body.linear_velocity = {1.5 + 0.1 * i, 0, 0.2};
    body.angular_velocity = {1, 2, -3};
    const auto simulator = make_simulator(m.scene, m.model);
    run(*simulator, 240);
    const double y = simulator->states().position[2].y();
    EXPECT_TRUE(y < 0.25 || y > 1.02) << i << ": hangs at " << y;
  }
}

// Over the edges between triangles, large and small, at some speed.
TEST(Margins, NothingThatSlidesFallsThroughEdges) {
  for (const double size : {0.01, 0.1}) {
    SmallModel m;
    const uint32_t material = m.material(0, 0.02);
    TriangleMesh floor;
    add_mesh_grid({-50, 0, -50}, {0, 0, 100}, {100, 0, 0}, 300, floor);
    m.body(mesh_shape(m, floor), material, Vec3::Zero(), Role::fixed);
    const std::vector<uint32_t> shapes = {m.box(Vec3::Constant(size)), m.sphere(size / 2),
                                          pyramid(m, size), chair(m, size)};
    for (size_t i = 0; i < 16; ++i) {
      const uint32_t shape = shapes[i % 4];
      const double reach = -lowest_m(m.model.shapes[shape], {});
      const double angle = 0.4 * static_cast<double>(i);
      m.body(shape, material, {1.0 * static_cast<double>(i), reach, 0}).linear_velocity =
          2 * Vec3(std::cos(angle), 0, std::sin(angle));
    }
    const auto simulator = make_simulator(m.scene, m.model);
    for (int frame = 0; frame < 120; ++frame) {
      simulator->step_frame();
      for (size_t i = 1; i < simulator->states().size(); ++i) {
        ASSERT_GT(simulator->states().position[i].y(), 0.1 * size) << "body " << i;
      }
    }
  }
}

}  // namespace
}  // namespace pilesim
