// The stacking structure and the ideal form of piles against closed forms.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "geometry/primitives.h"
#include "pile/repose/height_field.h"
#include "pile/repose/stacking_structure.h"

namespace pilesim {
namespace {

Pile cone_pile(double angle_deg) {
  return {.angle = radians(angle_deg), .centre = GroundPoint(0, 0)};
}

double cone_volume(double radius, double angle) {
  return kPi / 3 * std::pow(radius, 3) * std::tan(angle);
}

TEST(PileShape, ConeHasTheRadiusOfEquation51) {
  for (const double angle_deg : {15.0, 30.0, 45.0, 60.0}) {
    const PileShape shape(cone_pile(angle_deg), GroundPoint::Zero());
    const double volume = 400 * 0.008;
    const double radius = std::cbrt(3 * volume / (kPi * std::tan(radians(angle_deg))));
    EXPECT_NEAR(shape.reach_of_volume(volume), radius, 1e-9);
    EXPECT_NEAR(shape.volume(radius), volume, 1e-9);
    EXPECT_NEAR(shape.apex_height(radius), radius * std::tan(radians(angle_deg)), 1e-12);
  }
}

TEST(PileShape, LineIsARidgeBetweenTwoHalvesOfACone) {
  Pile pile{.angle = radians(35), .footprint = {{-1, 0}, {2, 0}}};
  const PileShape shape(pile, GroundPoint::Zero());
  const double reach = 0.8;
  const double ridge = 3 * reach * reach * std::tan(pile.angle);
  EXPECT_NEAR(shape.volume(reach), ridge + cone_volume(reach, pile.angle), 1e-12);
  EXPECT_NEAR(shape.distance({0.5, -0.3}), 0.3, 1e-12);
  EXPECT_NEAR(shape.distance({2.3, 0.4}), 0.5, 1e-12);
  EXPECT_NEAR((shape.outward({0.5, -0.3}) - GroundPoint(0, -1)).norm(), 0, 1e-12);
}

TEST(PileShape, PolygonGrowsBySteinersFormulaInEitherSense) {
  for (const bool reversed : {false, true}) {
    Pile pile{.angle = radians(40), .footprint = {{0, 0}, {2, 0}, {2, 1}, {0, 1}}};
    if (reversed) std::ranges::reverse(pile.footprint);
    const PileShape shape(pile, GroundPoint::Zero());
    EXPECT_EQ(shape.distance({1, 0.5}), 0);
    EXPECT_EQ(shape.outward({1, 0.5}), GroundPoint::Zero());
    EXPECT_NEAR(shape.distance({3, 0.5}), 1, 1e-12);
    const double volume = std::tan(pile.angle) * (2 * 0.5 + 3 * 0.25 + kPi / 3 * 0.125);
    EXPECT_NEAR(shape.volume(0.5), volume, 1e-12);
  }
}

// Equal lengths of the line round the core are equal shares of it.
TEST(PileShape, TheWayRoundACoreIsByLength) {
  const PileShape point(cone_pile(30), GroundPoint::Zero());
  EXPECT_NEAR(point.way_round({0, 2}, 1), 0.25, 1e-12);
  EXPECT_NEAR(point.way_round({0, -2}, 1), 0.75, 1e-12);
  const PileShape line(Pile{.angle = 0.5, .footprint = {{-1, 0}, {1, 0}}}, GroundPoint::Zero());
  const double arc = kPi * 0.5;
  const double all = 4 + 2 * arc;
  EXPECT_NEAR(line.way_round({0.5, -0.3}, 0.5), 1.5 / all, 1e-9);
  EXPECT_NEAR(line.way_round({1.7, 0}, 0.5), (2 + arc / 2) / all, 1e-9);
  EXPECT_NEAR(line.way_round({0.5, 0.7}, 0.5), (2.5 + arc) / all, 1e-9);
  EXPECT_NEAR(line.way_round({-1.2, 0}, 0.5), (4 + 1.5 * arc) / all, 1e-9);
  const PileShape square(Pile{.angle = 0.5, .footprint = {{0, 0}, {2, 0}, {2, 2}, {0, 2}}},
                         GroundPoint::Zero());
  double before = 0;
  for (int i = 0; i < 80; ++i) {  // once round, at distance 1
    const double s = (i + 0.5) / 80 * (8 + 2 * kPi);
    const double on_side = std::fmod(s, 2 + kPi / 2);
    const double turned = kPi / 2 * std::floor(s / (2 + kPi / 2));
    const double around = std::max(0.0, on_side - 2) - kPi / 2;
    const GroundPoint from_middle = GroundPoint(std::min(on_side, 2.0) - 1, -1) +
                                    GroundPoint(std::cos(around), std::sin(around));
    const GroundPoint at = GroundPoint(1, 1) + Eigen::Rotation2Dd(turned) * from_middle;
    EXPECT_NEAR(square.way_round(at, 1), (i + 0.5) / 80, 1e-9) << at.transpose();
    EXPECT_GT(square.way_round(at, 1), before);
    before = square.way_round(at, 1);
  }
}

Pile boxed(double rim_m) {
  Pile pile = cone_pile(30);
  pile.boundary = PileBoundary{{{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}, rim_m};
  return pile;
}

TEST(PileShape, WallsCutTheConeAndItStopsAtTheRim) {
  const PileShape shape(boxed(0.5), GroundPoint::Zero());
  const double slope = std::tan(radians(30));
  EXPECT_NEAR(shape.volume(0.9), cone_volume(0.9, radians(30)), 2e-3) << "before the walls";
  EXPECT_NEAR(shape.most_reach(), 1 + 0.5 / slope, 1e-9);
  // Over the whole square: the mean distance from the middle of a square of half width 1.
  const double mean = (std::sqrt(2.0) + std::asinh(1.0)) / 3;
  EXPECT_NEAR(shape.volume(3), 4 * slope * (3 - mean), 2e-3);
  EXPECT_EQ(shape.reach_of_volume(1e3), shape.most_reach()) << "full: the rest spills";
}

TEST(StackingStructure, LayersAreFrustaOfTheCone) {
  const double angle = radians(45);
  const PileShape shape(cone_pile(45), GroundPoint::Zero());
  const StackingStructure structure(shape, cone_volume(1, angle), 0.23);
  ASSERT_EQ(structure.layers().size(), 4) << "floor(1 / 0.23)";
  double volume = 0;
  for (size_t i = 0; i < 4; ++i) {
    const StackingLayer& layer = structure.layers()[i];
    const double below = 1 - 0.25 * static_cast<double>(i);
    const double above = below - 0.25;
    EXPECT_NEAR(layer.reach_m, below, 1e-9);
    EXPECT_NEAR(layer.volume_m3, kPi * 0.25 / 3 * (below * below + below * above + above * above),
                1e-9);
    EXPECT_GE(layer.top_m - layer.bottom_m, 0.23) << "no body spans more than two layers";
    volume += layer.volume_m3;
  }
  EXPECT_NEAR(volume, cone_volume(1, angle), 1e-9);
}

TEST(StackingStructure, CountsBodiesByTheirCentres) {
  const PileShape shape(cone_pile(45), GroundPoint::Zero());
  StackingStructure structure(shape, cone_volume(1, radians(45)), 0.23);
  EXPECT_TRUE(structure.count(0.1, 0.9, 0.01, true));
  EXPECT_TRUE(structure.count(0.3, 0.2, 0.02, false));
  EXPECT_FALSE(structure.count(0.1, 1.01, 0.01, true)) << "beyond the foot";
  EXPECT_FALSE(structure.count(1.01, 0, 0.01, true)) << "over the apex";
  EXPECT_FALSE(structure.count(-0.01, 0, 0.01, true)) << "below";
  const StackingLayer& lowest = structure.layers()[0];
  EXPECT_EQ(lowest.bodies, 1);
  EXPECT_NEAR(lowest.density(), 0.01 / lowest.volume_m3, 1e-12);
  EXPECT_NEAR(structure.occupation(), 0.03 / cone_volume(1, radians(45)), 1e-9);
  EXPECT_NEAR(structure.closeness(0, 0.25), 0.75, 1e-9);
  EXPECT_EQ(structure.closeness(0, 2), 0);
}

TEST(StackingStructure, LayersSleepFromTheBottomUp) {
  const PileShape shape(cone_pile(45), GroundPoint::Zero());
  StackingStructure structure(shape, cone_volume(1, radians(45)), 0.23);
  EXPECT_TRUE(structure.layers_below_sleep(0));
  EXPECT_FALSE(structure.layers_below_sleep(1));
  structure.count(0.3, 0, 0.01, true);
  EXPECT_FALSE(structure.layers_below_sleep(2)) << "the lowest is awake";
  structure.count(0.1, 0, 0.01, true);
  EXPECT_TRUE(structure.layers_below_sleep(2));
}

// A cone with small spheres on its surface, as bodies would cover it.
HeightField sampled_cone(double angle, double radius) {
  const GroundPoint corner = GroundPoint::Constant(2 * radius);
  HeightField field({-corner, corner}, radius / 40, 0);
  const std::vector<Vec3> point = {Vec3::Zero()};
  field.for_each([&](const GroundPoint& at, double) {
    const double height = std::max(0.0, (radius - at.norm()) * std::tan(angle));
    field.add(columns_of(point, {Vec3(at.x(), height, at.y()), Quat::Identity()}, radius / 40));
  });
  return field;
}

TEST(HeightField, GivesBackTheAngleAndTheReachOfACone) {
  for (const double angle_deg : {15.0, 32.0, 50.0}) {
    const PileShape asked(cone_pile(30), GroundPoint::Zero());  // not the present angle
    const HeightField field = sampled_cone(radians(angle_deg), 1);
    const Territory everywhere = [](const GroundPoint&) { return true; };
    const SlopeFit fit = fit_slope(slope_angles(asked, field, everywhere));
    EXPECT_EQ(fit.azimuths, kAzimuths);
    EXPECT_NEAR(degrees(fit.angle), angle_deg, 0.3);
    EXPECT_LT(degrees(fit.spread), 0.5);
    const PileShape same(cone_pile(angle_deg), GroundPoint::Zero());
    std::vector<SurfaceCell> cells;
    field.for_each([&](const GroundPoint& at, double height_m) {
      cells.push_back({same.distance(at), height_m, 0, 1});
    });
    EXPECT_NEAR(reach_of_bulk(same, cells, field.cell_m()), 1, 0.02);
  }
}

TEST(HeightField, SurfacePointsCoverAMesh) {
  const std::vector<Vec3> points = surface_points(box_mesh(Vec3(1, 2, 3)), 0.25);
  double highest = 0;
  for (const Vec3& point : points) highest = std::max(highest, point.y());
  EXPECT_EQ(highest, 1);
  EXPECT_GT(points.size(), 22 / 0.0625 * 0.7) << "of the area over that of a point";
}

}  // namespace
}  // namespace pilesim
