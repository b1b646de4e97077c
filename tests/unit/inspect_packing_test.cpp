// The measures of beds (tests/support/packing.h) on arrangements with a known solid share.
#include "support/packing.h"

#include <gtest/gtest.h>

#include <cmath>

#include "geometry/mesh_check.h"
#include "geometry/primitives.h"
#include "support/measured_profiles.h"
#include "support/packed_solids.h"

namespace pilesim {
namespace {

struct Arrangement {
  Model model;
  std::vector<Vec3> position;
  std::vector<Quat> orientation;
  std::vector<uint8_t> flags;

  uint32_t shape(CollisionPiece piece, double volume_m3, double bounding_radius) {
    ModelShape shape;
    shape.mass.volume_m3 = volume_m3;
    shape.bounding_radius = bounding_radius;
    shape.pieces.push_back(std::move(piece));
    model.shapes.push_back(std::move(shape));
    return static_cast<uint32_t>(model.shapes.size() - 1);
  }
  uint32_t hull(const TriangleMesh& mesh) {
    double radius = 0;
    for (const Vec3& vertex : mesh.vertices) radius = std::max(radius, vertex.norm());
    return shape({CollisionPiece::Kind::hull, {}, Vec3::Zero(), mesh},
                 mass_properties(mesh).volume_m3, radius);
  }
  void add(uint32_t shape, const Vec3& at, const Quat& turn = Quat::Identity(),
           Role role = Role::dynamic, uint8_t flag = kPresent) {
    ModelBody body{.linear_velocity = Vec3::Zero(), .angular_velocity = Vec3::Zero()};
    body.shape = shape;
    body.role = role;
    model.bodies.push_back(body);
    position.push_back(at);
    orientation.push_back(turn);
    flags.push_back(flag);
  }
  PackedBodies packing() const { return {model, position, orientation, flags}; }
};

TEST(Packing, ASphereInAColumn) {
  Arrangement one;
  const double radius = 0.3;
  const double volume = 4.0 / 3 * kPi * radius * radius * radius;
  one.add(one.shape({CollisionPiece::Kind::sphere, {}, Vec3::Constant(radius), {}}, volume, radius),
          Vec3(0.1, 0.5, -0.2));
  const Fill fill = fill_of(one.packing(), {.radius_m = 0.6, .low_m = 0, .high_m = 1}, 200000);
  EXPECT_NEAR(fill.by_volume, volume / (kPi * 0.36), 1e-3);
  EXPECT_EQ(fill.by_volume, fill.covered);
  EXPECT_NEAR(bed_height_m(one.packing(), 0), 1, 1e-12);
}

TEST(Packing, ALatticeOfTurnedCubes) {
  // Turned about the vertical, so that a lattice of slabs' heights stays exact.
  Arrangement lattice;
  const double edge = 0.08, spacing = 0.1;
  const uint32_t cube = lattice.hull(box_mesh(Vec3::Constant(edge)));
  const Quat turn(Eigen::AngleAxisd(0.3, Vec3::UnitY()));
  for (int x = -12; x <= 12; ++x) {
    for (int y = 0; y < 10; ++y) {
      for (int z = -12; z <= 12; ++z) lattice.add(cube, spacing * Vec3(x, y + 0.5, z), turn);
    }
  }
  const Fill fill = fill_of(lattice.packing(), {.radius_m = 1, .low_m = 0, .high_m = 1}, 400000);
  EXPECT_NEAR(fill.by_volume, std::pow(edge / spacing, 3), 3e-3);
  EXPECT_LT(fill.standard_error, 1e-3);
}

TEST(Packing, CountsWhatIsSharedOnceAndTwice) {
  Arrangement two;
  const uint32_t box = two.shape({CollisionPiece::Kind::box, {}, Vec3(1, 1, 1), {}}, 1, 1);
  two.add(box, Vec3(0, 0.5, 0));
  two.add(box, Vec3(0, 0.5, 0));
  two.add(box, Vec3(0, 0.5, 0), Quat::Identity(), Role::fixed);
  two.add(box, Vec3(0, 0.5, 0), Quat::Identity(), Role::dynamic, 0);
  const Fill fill = fill_of(two.packing(), {.radius_m = 0.4, .low_m = 0, .high_m = 2}, 100000);
  EXPECT_NEAR(fill.by_volume, 1, 1e-3);
  EXPECT_NEAR(fill.covered, 0.5, 1e-3);
}

TEST(Packing, TheProfileOfACylinderOnTheAxis) {
  Arrangement one;
  one.add(one.shape({.kind = CollisionPiece::Kind::round, .round = RoundSector::cylinder(0.5, 1)},
                    kPi / 4, 0.8),
          Vec3(0, 0.5, 0));
  const std::vector<double> porosity =
      porosity_from_wall(one.packing(), {.radius_m = 1, .low_m = 0, .high_m = 2}, 10, 20000);
  for (int bin = 0; bin < 5; ++bin) EXPECT_EQ(porosity[bin], 1) << bin;
  for (int bin = 5; bin < 10; ++bin) EXPECT_NEAR(porosity[bin], 0.5, 2e-3) << bin;
}

TEST(Packing, TheProfileOfASphereOnTheAxis) {
  Arrangement one;
  one.add(one.shape({CollisionPiece::Kind::sphere, {}, Vec3::Constant(1), {}}, 4.0 / 3 * kPi, 1),
          Vec3(0, 1, 0));
  const std::vector<double> porosity =
      porosity_from_wall(one.packing(), {.radius_m = 1, .low_m = 0, .high_m = 2}, 10, 50000);
  // The mean of sqrt(1 - r^2) over a ring.
  const auto cap = [](double r) { return std::pow(1 - r * r, 1.5); };
  for (int bin = 0; bin < 10; ++bin) {
    const double outer = 1 - bin / 10.0, inner = 1 - (bin + 1) / 10.0;
    const double mean = 2.0 / 3 * (cap(inner) - cap(outer)) / (outer * outer - inner * inner);
    EXPECT_NEAR(porosity[bin], 1 - mean, 3e-3) << bin;
  }
}

// Rings of 0.1 whose porosity falls by 0.2 per diameter, and points on that line with an offset, in
// units of 2 diameters.
TEST(MeasuredProfile, DiffersByWhatItWasMovedBy) {
  std::vector<double> porosity;
  for (int ring = 0; ring < 20; ++ring) porosity.push_back(0.9 - 0.2 * 0.1 * (ring + 0.5));
  MeasuredProfile measured{.unit = 2, .tube = 4, .points = {}};
  double sign = 1;
  for (const double place : {0.3, 0.5, 0.77, 1.2, 1.9}) {
    measured.points.push_back({place / 2, 1 - (0.9 - 0.2 * place) + 0.01 + 0.02 * sign});
    sign = -sign;
  }
  const ProfileDifference off = difference(measured, porosity, 0.1, 1.5);
  EXPECT_EQ(off.points, 4);
  EXPECT_NEAR(off.reach, 1.2, 1e-12);
  EXPECT_NEAR(off.mean, 0.01, 1e-12);
  EXPECT_NEAR(off.size, 0.02, 1e-12);
  EXPECT_EQ(difference(measured, porosity, 0.1, 0.1).points, 0);
}

TEST(PackedSolids, HaveTheirFacesAndVolumes) {
  // Edge^3 over volume, and number of corners.
  struct Known {
    int faces;
    double cubed_edge;
    size_t corners;
  };
  const double root5 = std::sqrt(5.0);
  for (const Known& known :
       {Known{4, 6 * std::sqrt(2.0), 4}, Known{6, 1, 8}, Known{8, 3 / std::sqrt(2.0), 6},
        Known{12, 4 / (15 + 7 * root5), 20}, Known{20, 12 / (5 * (3 + root5)), 12}}) {
    const TriangleMesh mesh = platonic_solid(known.faces);
    EXPECT_EQ(mesh.vertices.size(), known.corners);
    EXPECT_NEAR(mass_properties(mesh).volume_m3, 1, 1e-12);
    double shortest = 10;
    for (size_t i = 1; i < mesh.vertices.size(); ++i) {
      shortest = std::min(shortest, (mesh.vertices[i] - mesh.vertices[0]).norm());
    }
    EXPECT_NEAR(shortest, std::cbrt(known.cubed_edge), 1e-12) << known.faces;
  }
}

TEST(PackedSolids, RingsAndCupsAreSolids) {
  EXPECT_TRUE(find_mesh_defects(ring_mesh(0.5, 0.3, 1, 16)).empty());
  EXPECT_TRUE(find_mesh_defects(ring_mesh(0.5, 0, 1, 16)).empty());
  EXPECT_TRUE(find_mesh_defects(cup_mesh(1, 3, 0.2, 48)).empty());
  EXPECT_NEAR(mass_properties(ring_mesh(0.5, 0.3, 1, 16)).volume_m3, kPi * (0.25 - 0.09), 1e-12);
  EXPECT_NEAR(mass_properties(ring_mesh(0.5, 0, 1, 32)).volume_m3, kPi / 4, 1e-12);
}

}  // namespace
}  // namespace pilesim
