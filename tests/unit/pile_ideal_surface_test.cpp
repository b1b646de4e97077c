// The ideal surface of a pile and the measured slope, against known forms.
#include <gtest/gtest.h>

#include "core/philox.h"
#include "pile/repose/pile_set.h"

namespace pilesim {
namespace {

const Territory kEverywhere = [](const GroundPoint&) { return true; };

PileShape cone(double angle_deg) {
  return {Pile{.angle = radians(angle_deg), .centre = GroundPoint(0, 0)}, GroundPoint::Zero()};
}

// Heights over the ground at every cell.
template <class Height>
HeightField field_of(const Height& height, double half_width_m = 2, double cell_m = 0.02) {
  const GroundPoint corner = GroundPoint::Constant(half_width_m);
  HeightField field({-corner, corner}, cell_m, 0);
  const std::vector<Vec3> point = {Vec3::Zero()};
  field.for_each([&](const GroundPoint& at, double) {
    field.add(columns_of(point, {Vec3(at.x(), height(at), at.y()), Quat::Identity()}, cell_m));
  });
  return field;
}

std::vector<SurfaceCell> cells_of(const PileShape& shape, const HeightField& field) {
  std::vector<SurfaceCell> cells;
  field.for_each([&](const GroundPoint& at, double height_m) {
    cells.push_back({shape.distance(at), height_m, shape.way_round(at, 0), 1});
  });
  return cells;
}

TEST(IdealSurface, OfAnIdealConeNothingMustMove) {
  const double slope = std::tan(radians(25));
  const HeightField field =
      field_of([&](const GroundPoint& at) { return std::max(0.0, (1 - at.norm()) * slope); });
  IdealSurface ideal;
  ideal.update(cone(25), cells_of(cone(25), field), field.cell_m(), 0.1);
  EXPECT_NEAR(ideal.reach_m(), 1, 0.01);
  EXPECT_NEAR(ideal.height_m(0.25), 0.75 * slope, 0.01);
  for (const double distance : {0.1, 0.3, 0.6, 0.9}) {
    EXPECT_NEAR(ideal.surplus_m(distance), 0, 0.01);
    EXPECT_NEAR(ideal.outflow(distance), 0, 0.1);
  }
}

// A flat cylinder contains less than the cone near its axis, and more at its edge.
TEST(IdealSurface, OutflowIsWhatTheConeHasLessOfInside) {
  const double slope = std::tan(radians(25));
  const double radius = 0.7;
  const double height = slope / 3 / (radius * radius);  // as much as a cone of reach 1
  const double size_m = 0.1;
  const HeightField field =
      field_of([&](const GroundPoint& at) { return at.norm() < radius ? height : 0.0; });
  IdealSurface ideal;
  ideal.update(cone(25), cells_of(cone(25), field), field.cell_m(), size_m);
  ASSERT_NEAR(ideal.reach_m(), 1, 0.02);
  for (const double d : {0.3, 0.5, 0.7}) {
    const double inside_m3 = kPi * d * d * height - kPi * slope * (d * d - 2 * d * d * d / 3);
    // Length of the ring that ends there.
    const double line_m = 2 * kPi * (d - 0.05);
    EXPECT_NEAR(ideal.outflow(d), inside_m3 / line_m / (size_m * size_m), 0.15) << d;
  }
  EXPECT_GT(ideal.outflow(0.7), 0.5);
  EXPECT_LT(ideal.surplus_m(0.1), -0.05);
  EXPECT_GT(ideal.surplus_m(0.6), 0.05);
  EXPECT_EQ(ideal.outflow(1.2), 0) << "beyond the foot";
}

TEST(IdealSurface, FewBodiesHaveNoSlopes) {
  const HeightField field =
      field_of([](const GroundPoint& at) { return at.norm() < 0.2 ? 0.3 : 0.0; });
  IdealSurface ideal;
  ideal.update(cone(40), cells_of(cone(40), field), field.cell_m(), 0.2);
  EXPECT_GT(ideal.reach_m(), 0);
  EXPECT_EQ(ideal.outflow(0.1), 0);
}

// A ridge with a slope in one half and a mesa of equal volume in the other: only there must bodies
// move outwards.
TEST(IdealSurface, EachSectionOfARidgeHasItsOwn) {
  const double slope = std::tan(radians(35)), size_m = 0.15;
  const PileShape ridge(
      Pile{.angle = radians(35), .footprint = {GroundPoint(-3, 0), GroundPoint(3, 0)}},
      GroundPoint::Zero());
  const double half_m = 0.7;  // of the mesa
  const HeightField field = field_of(
      [&](const GroundPoint& at) {
        const double d = ridge.distance(at);
        if (at.x() < 0) return std::max(0.0, (1 - d) * slope);
        return d < half_m ? slope / 2 / half_m : 0.0;
      },
      4.5, 0.04);
  IdealSurface ideal;
  for (int look = 0; look < 2; ++look) {
    std::vector<SurfaceCell> cells;
    const double middle_m = ideal.reach_m() / 2;
    field.for_each([&](const GroundPoint& at, double height_m) {
      cells.push_back({ridge.distance(at), height_m, ridge.way_round(at, middle_m), 1});
    });
    ideal.update(ridge, cells, field.cell_m(), size_m);
  }
  const auto outflow = [&](double x, double z) {
    return ideal.outflow(std::abs(z), ridge.way_round({x, z}, ideal.reach_m() / 2));
  };
  const auto reach_m = [&](double x, double z) {
    return ideal.reach_m(ridge.way_round({x, z}, ideal.reach_m() / 2));
  };
  const double mesa_m2 = half_m * slope / 2 / half_m;
  const double slope_m2 = (half_m - half_m * half_m / 2) * slope;
  for (const double z : {-half_m, half_m}) {
    EXPECT_NEAR(outflow(-1.8, z), 0, 0.2) << z;
    EXPECT_NEAR(outflow(1.8, z), (mesa_m2 - slope_m2) / (size_m * size_m), 0.3) << z;
    EXPECT_NEAR(reach_m(-1.8, z), 1, 0.03) << z;
    EXPECT_NEAR(reach_m(1.8, z), 1, 0.03) << z;
  }
}

// The same holds for the sections of a cone: a heap on one side must be released there, and nothing
// beside it.
TEST(IdealSurface, EachSectionOfAConeHasItsOwn) {
  const double slope = std::tan(radians(35)), mesa_m = 0.7, size_m = 0.1;
  const PileShape shape = cone(35);
  const HeightField field = field_of([&](const GroundPoint& at) {
    const double d = at.norm();
    if (at.x() < 0) return std::max(0.0, (1 - d) * slope);
    return d < mesa_m ? slope / 3 / (mesa_m * mesa_m) : 0.0;
  });
  IdealSurface ideal;
  ideal.update(shape, cells_of(shape, field), field.cell_m(), size_m);
  const auto outflow = [&](double x, double z) {
    return ideal.outflow(std::hypot(x, z), shape.way_round({x, z}, 0));
  };
  const double inside_m3 = slope / 3 - slope * (mesa_m * mesa_m - 2 * std::pow(mesa_m, 3) / 3);
  const double expected = kPi * inside_m3 / (2 * kPi * (mesa_m - 0.05)) / (size_m * size_m);
  ASSERT_GT(expected, 0.4);
  EXPECT_NEAR(outflow(mesa_m, 0), expected, 0.15);
  EXPECT_NEAR(outflow(-mesa_m, 0), 0, 0.1);
}

TEST(PileState, KnowsTheWayRoundACone) {
  PileState pile;
  pile.shape = cone(35);
  EXPECT_NEAR(pile.round({0, 1}), 0.25, 1e-12);
  EXPECT_NEAR(pile.round({0, -1}), 0.75, 1e-12);
}

// A cone with twice the volume on one side has its foot farther out there.
TEST(IdealSurface, SectionsReachAsFarAsTheirBulk) {
  const double slope = std::tan(radians(30));
  const PileShape shape = cone(30);
  const HeightField field = field_of([&](const GroundPoint& at) {
    return std::max(0.0, ((at.x() < 0 ? 1 : 1.25) - at.norm()) * slope);
  });
  IdealSurface ideal;
  ideal.update(shape, cells_of(shape, field), field.cell_m(), 0.1);
  EXPECT_NEAR(ideal.reach_m(shape.way_round({-1, 0}, 0)), 1, 0.02);
  EXPECT_NEAR(ideal.reach_m(shape.way_round({1, 0.2}, 0)), 1.25, 0.02);
  EXPECT_GT(ideal.reach_m(), 1.05);
  EXPECT_LT(ideal.reach_m(), 1.2);
}

// A volume in one quarter alone would reach 4^(1/3) times farther than all round, with nothing
// elsewhere: the foot of a pile is not torn that far.
TEST(IdealSurface, NoSectionReachesMuchFartherThanTheWhole) {
  const double slope = std::tan(radians(30));
  const PileShape shape = cone(30);
  const HeightField field = field_of([&](const GroundPoint& at) {
    const bool heaped = at.x() > std::abs(at.y());
    return heaped ? std::max(0.0, (1 - at.norm()) * slope) : 0.0;
  });
  IdealSurface ideal;
  ideal.update(shape, cells_of(shape, field), field.cell_m(), 0.05);
  const double whole_m = ideal.reach_m();
  EXPECT_NEAR(ideal.reach_m(shape.way_round({1, 0}, 0)), 1.4 * whole_m, 1e-9);
  EXPECT_NEAR(ideal.reach_m(shape.way_round({-1, 0}, 0)), 0.6 * whole_m, 1e-9);
}

// A moving body counts for the line that it approaches, by its volume and its distance.
TEST(IdealSurface, MovingVolumeCountsAsGone) {
  const double slope = std::tan(radians(25)), size_m = 0.1;
  const HeightField field =
      field_of([&](const GroundPoint& at) { return std::max(0.0, (1 - at.norm()) * slope); });
  IdealSurface still, moving;
  still.update(cone(25), cells_of(cone(25), field), field.cell_m(), size_m);
  const double ring_m = still.reach_m() / 10;
  const double edge_m = 5 * ring_m;
  const double volume_m3 = 0.01, ahead_m = 0.05;
  // The same all round.
  const auto around = [&](const std::vector<MovingBulk>& bulks) {
    std::vector<MovingBulk> all;
    const int parts = 140;
    for (MovingBulk bulk : bulks) {
      bulk.volume_m3 /= parts;
      for (int i = 0; i < parts; ++i) {
        bulk.round = (i + 0.5) / parts;
        all.push_back(bulk);
      }
    }
    return all;
  };
  // Half a ring before the edge: half of it counts.
  moving.update(cone(25), cells_of(cone(25), field), field.cell_m(), size_m,
                around({{edge_m - ring_m / 2, volume_m3, ahead_m}}));
  const double line_m = 2 * kPi * (edge_m - ring_m / 2);
  const double passing = 0.5 * volume_m3 * ahead_m / ring_m / (line_m * size_m * size_m);
  ASSERT_GT(passing, 0.05);
  EXPECT_NEAR(still.outflow(edge_m) - moving.outflow(edge_m), passing, 0.02 * passing);
  EXPECT_EQ(moving.outflow(7 * ring_m), still.outflow(7 * ring_m)) << "too far away";
  moving.update(cone(25), cells_of(cone(25), field), field.cell_m(), size_m,
                around({{edge_m, volume_m3, ahead_m}, {edge_m, volume_m3, -ahead_m}}));
  EXPECT_NEAR(moving.outflow(edge_m), still.outflow(edge_m), 1e-12) << "inwards against outwards";
}

// A neighbour on half of the ground leaves the other half for the measurement.
TEST(SlopeFit, LeavesOutTheAzimuthsOfANeighbour) {
  const double slope = std::tan(radians(30));
  const HeightField field = field_of([&](const GroundPoint& at) {
    const double to_second = (at - GroundPoint(1, 0)).norm();
    return std::max({0.0, (1 - at.norm()) * slope, (1 - to_second) * slope});
  });
  const Territory own = [](const GroundPoint& at) { return at.x() < 0.5; };
  const std::vector<double> angles = slope_angles(cone(30), field, own);
  EXPECT_LT(angles.size(), 13u);
  EXPECT_GT(angles.size(), 7u);
  const SlopeFit fit = fit_slope(angles);
  EXPECT_NEAR(degrees(fit.angle), 30, 0.5);
  EXPECT_LT(degrees(fit.spread), 1);
}

// Bodies make a pile rough: cells of body size are up to half a body too high or too low. The slope
// must not depend on it. In particular it must not become flatter, as it would if the heights of
// each azimuth chose the ends of the line.
TEST(SlopeFit, RoughConesKeepTheirAngle) {
  for (const double angle_deg : {15.0, 30.0, 50.0}) {
    const double slope = std::tan(radians(angle_deg));
    const double size_m = 0.25 * slope;  // the pile is four bodies high
    double sum = 0;
    constexpr int kPiles = 12;
    for (uint32_t pile = 0; pile < kPiles; ++pile) {
      const HeightField field = field_of(
          [&](const GroundPoint& at) {
            const auto column = static_cast<uint32_t>(std::floor(at.x() / size_m) + 1000);
            const auto row = static_cast<uint32_t>(std::floor(at.y() / size_m) + 1000);
            Philox random(pile, Stream::test, column, row);
            const double rough_m = size_m * (random.uniform() - 0.5);
            return at.norm() < 1 ? std::max(0.0, (1 - at.norm()) * slope + rough_m) : 0.0;
          },
          1.5, 0.35 * size_m);
      sum += degrees(fit_slope(slope_angles(cone(angle_deg), field, kEverywhere)).angle);
    }
    EXPECT_NEAR(sum / kPiles, angle_deg, 1.2) << angle_deg;
  }
}

// One side of a ridge may have a larger volume than another; each has the slope.
TEST(SlopeFit, UnevenRidgesKeepTheirAngle) {
  for (const double angle_deg : {20.0, 40.0}) {
    const double slope = std::tan(radians(angle_deg));
    const double size_m = 0.25 * slope;
    const PileShape ridge(
        Pile{.angle = radians(angle_deg), .footprint = {GroundPoint(-2, 0), GroundPoint(2, 0)}},
        GroundPoint::Zero());
    double sum = 0;
    constexpr int kPiles = 12;
    for (uint32_t pile = 0; pile < kPiles; ++pile) {
      const HeightField field = field_of(
          [&](const GroundPoint& at) {
            const double reach = 1 + 0.25 * std::sin(3 * at.x() + (at.y() > 0 ? 0 : 2));
            const auto column = static_cast<uint32_t>(std::floor(at.x() / size_m) + 1000);
            const auto row = static_cast<uint32_t>(std::floor(at.y() / size_m) + 1000);
            Philox random(pile, Stream::test, column, row);
            const double rough_m = size_m * (random.uniform() - 0.5);
            const double under_m = reach - ridge.distance(at);
            return under_m > 0 ? std::max(0.0, under_m * slope + rough_m) : 0.0;
          },
          3.5, 0.35 * size_m);
      sum += degrees(fit_slope(slope_angles(ridge, field, kEverywhere)).angle);
    }
    EXPECT_NEAR(sum / kPiles, angle_deg, 1.2) << angle_deg;
  }
}

// Walls hold the foot of a cone and the bodies in their corners.
TEST(SlopeFit, InABoxIsThatOfWhatStandsOverIt) {
  Pile pile{.angle = radians(50), .centre = GroundPoint(0, 0)};
  pile.boundary = PileBoundary{{{-0.8, -0.8}, {0.8, -0.8}, {0.8, 0.8}, {-0.8, 0.8}}, 0.5};
  const PileShape shape(pile, GroundPoint::Zero());
  for (const double angle_deg : {30.0, 50.0}) {
    const HeightField field = field_of([&](const GroundPoint& at) {
      return std::max(0.5, 0.5 + (0.8 - at.norm()) * std::tan(radians(angle_deg)));
    });
    const SlopeFit fit = fit_slope(slope_angles(shape, field, kEverywhere));
    EXPECT_EQ(fit.azimuths, kAzimuths);
    EXPECT_NEAR(degrees(fit.angle), angle_deg, 1);
  }
}

}  // namespace
}  // namespace pilesim
