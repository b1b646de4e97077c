// Parts of decompositions and their measures: hull volumes, volume differences, surface distances
// and fitted pieces.
#include <gmock/gmock.h>

#include "../geometry_shapes.h"
#include "core/philox.h"
#include "geometry/convex_hull.h"
#include "geometry/hull_volume.h"
#include "geometry/mass_properties.h"
#include "geometry/piece_fit.h"
#include "geometry/primitives.h"
#include "geometry/solid_difference.h"
#include "geometry/surface_distance.h"
#include "support/geometry_concave_shapes.h"
#include "support/random_vectors.h"

namespace pilesim {
namespace {

using test::volume;

TriangleMesh box_at(const Vec3& position, const Vec3& size) {
  return test::moved(box_mesh(size), {.position = position, .orientation = Quat::Identity()});
}

double total_area(const TriangleMesh& mesh) {
  double area = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    area += 0.5 *
            (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]).norm();
  }
  return area;
}

TEST(HullVolume, OfAGridOfPoints) {
  std::vector<Vec3> points;
  for (int x = 0; x < 6; ++x) {
    for (int y = 0; y < 6; ++y) {
      for (int z = 0; z < 6; ++z) points.emplace_back(x, 2 * y, 3 * z);
    }
  }
  HullVolume hull;
  EXPECT_NEAR(hull.compute(points), 5 * 10 * 15, 1e-9);
  for (const uint32_t v : hull.vertices()) {
    const Vec3& p = points[v];
    EXPECT_TRUE(p.x() == 0 || p.x() == 5 || p.y() == 0 || p.y() == 10 || p.z() == 0 || p.z() == 15);
  }
}

TEST(HullVolume, AgreesWithTheHullMesh) {
  HullVolume hull;
  for (uint64_t round = 0; round < 40; ++round) {
    Philox random(7, Stream::test, round);
    std::vector<Vec3> points;
    const uint32_t count = 4 + random.index(300);
    for (uint32_t k = 0; k < count; ++k) {
      Vec3 point = test::random_arrow(random, round % 2 == 0 ? 1 : 0, 1);
      // Every third set has many coplanar points, as cuts produce them.
      if (round % 3 == 0) point = point.cwiseMax(Vec3(-0.3, -0.5, -2)).cwiseMin(Vec3(2, 0.4, 0.6));
      points.push_back(point);
    }
    EXPECT_NEAR(hull.compute(points), volume(convex_hull(points)), 1e-8);
  }
}

TEST(HullVolume, OfFlatOrFewPointsIsZero) {
  HullVolume hull;
  EXPECT_EQ(hull.compute({}), 0);
  const std::vector<Vec3> square{{0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}, {0.5, 0.5, 1}};
  EXPECT_EQ(hull.compute(square), 0);
  const std::vector<Vec3> same(9, Vec3(1, 2, 3));
  EXPECT_EQ(hull.compute(same), 0);
}

TEST(SolidDifference, OfBoxesIsTheClosedForm) {
  const TriangleMesh mesh = box_at({0.1, 0, 0}, {2, 1, 1});
  const std::vector<TriangleMesh> pieces{box_at({0, 0, 0}, {1, 1.2, 1}),
                                         box_at({0.5, 0, 0}, {1, 1, 1})};
  const SolidDifference difference = solid_difference(mesh, pieces);
  EXPECT_NEAR(difference.mesh_volume_m3, 2.0, 2e-3);
  EXPECT_NEAR(difference.union_volume_m3, 1.2 + 0.5, 2e-3);
  EXPECT_NEAR(difference.common_volume_m3, 1.5, 2e-3);
  EXPECT_NEAR(difference.excess_m3(), 0.2, 1e-3);
  EXPECT_NEAR(difference.missing_m3(), 0.5, 2e-3);
}

TEST(SolidDifference, OfASolidAndItselfIsNothing) {
  const TriangleMesh blob = test::blob_mesh(3);
  const SolidDifference difference = solid_difference(blob, std::span(&blob, 1));
  EXPECT_NEAR(difference.mesh_volume_m3, volume(blob), 5e-4 * volume(blob));
  EXPECT_NEAR(difference.excess_m3(), 0, 1e-12);
  EXPECT_NEAR(difference.missing_m3(), 0, 1e-12);
}

TEST(OuterSurface, OfBoxesThatTouchIsThatOfTheirUnion) {
  const std::vector<TriangleMesh> pieces{box_at({0, 0, 0}, {1, 1, 1}),
                                         box_at({1, 0, 0}, {1, 1, 1})};
  EXPECT_NEAR(total_area(outer_surface(pieces)), 10.0, 1e-4);
}

TEST(OuterSurface, KeepsOneOfTwoFlushFacets) {
  const std::vector<TriangleMesh> pieces{box_at({0, 0, 0}, {1, 1, 1}),
                                         box_at({0.5, 0, 0}, {1, 1, 1})};
  EXPECT_NEAR(total_area(outer_surface(pieces)), 4 * 1.5 + 2, 1e-4);
}

// Cuts leave triangles that are thinner than any margin.
TEST(OuterSurface, OfThinTrianglesInsideNothingIsLeft) {
  const TriangleMesh beside = box_at({2, 0, 0}, {2, 2, 2});
  for (const double width : {1e-7, 3e-6, 1e-5, 2e-5, 1e-3}) {
    TriangleMesh cut = box_at({0, 0, 0}, {2, 2, 2});
    std::erase_if(cut.triangles, [&](const Triangle& t) {
      return std::ranges::all_of(t, [&](uint32_t v) { return cut.vertices[v].x() > 0.5; });
    });
    const auto first = static_cast<uint32_t>(cut.vertices.size());
    const std::array<double, 4> heights = {-1, 0, width, 1};
    for (const double y : heights) {
      cut.vertices.emplace_back(1, y, -1);
      cut.vertices.emplace_back(1, y, 1);
    }
    for (uint32_t k = first; k + 2 < cut.vertices.size(); k += 2) {
      cut.triangles.push_back({k, k + 2, k + 3});
      cut.triangles.push_back({k, k + 3, k + 1});
    }
    const std::array pieces = {cut, beside};
    const TriangleMesh whole = box_at({1, 0, 0}, {4, 2, 2});
    EXPECT_LT(surface_distance(outer_surface(pieces), whole).hausdorff_m, 1e-6) << width;
  }
}

TEST(OuterSurface, OfACrossIsThatOfTheUnion) {
  const std::vector<TriangleMesh> pieces{box_mesh({3, 1, 1}), box_mesh({1, 3, 1}),
                                         box_mesh({1, 1, 3})};
  // 24 seams of length 1 lose up to 1e-6 of the diagonal, which is 5.2, on either side.
  EXPECT_NEAR(total_area(outer_surface(pieces)), 6 * (4 + 1), 24 * 2 * 5.2e-6);
}

TEST(SurfaceDistance, OfNestedBoxesIsTheClosedForm) {
  const TriangleMesh inner = box_mesh({1, 1, 1});
  const TriangleMesh outer = box_mesh({1.2, 1.2, 1.2});
  const SurfaceDistance distance = surface_distance(inner, outer);
  EXPECT_NEAR(distance.hausdorff_m, 0.1 * std::sqrt(3.0), 1e-12);  // from the outer corners
  EXPECT_GT(distance.mean_m, 0.1);
  EXPECT_LT(distance.mean_m, 0.105);
  const SurfaceDistance reversed = surface_distance(outer, inner);
  EXPECT_DOUBLE_EQ(reversed.hausdorff_m, distance.hausdorff_m);
  EXPECT_NEAR(reversed.mean_m, distance.mean_m, 1e-15);
}

TEST(SurfaceDistance, OfASurfaceToItselfIsNothing) {
  const TriangleMesh blob = test::blob_mesh(2);
  const SurfaceDistance distance = surface_distance(blob, blob);
  EXPECT_LT(distance.hausdorff_m, 1e-12);
}

ConvexPart part_of(const TriangleMesh& mesh) {
  ConvexPart part;
  part.solid = faceted_solid(mesh);
  part.volume_m3 = part.solid.volume();
  part.hull_points = convex_hull(mesh.vertices).vertices;
  part.hull_volume_m3 = volume(convex_hull(mesh.vertices));
  return part;
}

double error(const TriangleMesh& mesh, const TriangleMesh& piece) {
  const SolidDifference difference = solid_difference(mesh, std::span(&piece, 1));
  return difference.excess_m3() + difference.missing_m3();
}

TEST(PieceFit, CutsOffWhatIsMoreAirThanSolid) {
  // A plate with a low rib: the hull roofs over the plate on both sides of it.
  const TriangleMesh ribbed =
      test::prism_mesh({{2, 1}, {1.95, 1.1}, {1.9, 1}, {0, 0.98}, {0, 0}, {4, 0}, {4, 1}}, 1.0);
  const ConvexPart part = part_of(ribbed);
  const TriangleMesh fitted =
      fit_piece(part, {.max_vertices = 64, .max_trim_m = 0.2, .min_gain_m3 = 1e-6});
  EXPECT_GT(part.excess(), 0.15);
  EXPECT_LT(error(ribbed, fitted), 0.4 * part.excess());
  EXPECT_NEAR(volume(convex_hull(fitted.vertices)), volume(fitted), 1e-9);
}

TEST(PieceFit, LeavesAConvexPartAlone) {
  const TriangleMesh sphere = sphere_mesh(1.0, 2);
  const TriangleMesh fitted =
      fit_piece(part_of(sphere), {.max_vertices = 255, .max_trim_m = 0.1, .min_gain_m3 = 1e-6});
  EXPECT_NEAR(volume(fitted), volume(sphere), 1e-12);
}

TEST(PieceFit, KeepsTheEndsOfSeams) {
  // An eighth of a ball: the cuts meet at its centre and along three edges.
  FacetedSolid ball = faceted_solid(sphere_mesh(1.0, 3));
  for (const Vec3& axis : std::vector<Vec3>{Vec3::UnitX(), Vec3::UnitY(), Vec3::UnitZ()}) {
    ball = split(ball, {axis, 0.003}).above;
  }
  ConvexPart part;
  part.solid = ball;
  part.volume_m3 = ball.volume();
  part.hull_points = convex_hull(ball.vertices).vertices;
  const TriangleMesh fitted =
      fit_piece(part, {.max_vertices = 12, .max_trim_m = 0.0, .min_gain_m3 = 1e-6});
  EXPECT_LE(fitted.vertices.size(), 12u);
  EXPECT_THAT(fitted.vertices, testing::Contains(testing::Truly([](const Vec3& p) {
                return (p - Vec3(0.003, 0.003, 0.003)).norm() < 1e-9;
              })));
  EXPECT_GT(volume(fitted), 0.8 * part.volume_m3);
}

}  // namespace
}  // namespace pilesim
