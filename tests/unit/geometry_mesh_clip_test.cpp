#include "geometry/mesh_clip.h"

#include <gtest/gtest.h>

#include <numeric>

#include "../geometry_shapes.h"
#include "core/philox.h"
#include "geometry/primitives.h"
#include "support/geometry_concave_shapes.h"

namespace pilesim {
namespace {

// The area vectors of a closed surface sum to zero.
Vec3 area_vector(const FacetedSolid& solid) {
  Vec3 sum = Vec3::Zero();
  for (const auto& edge : solid.edges) {
    sum += 0.5 * solid.vertices[edge.from].cross(solid.vertices[edge.to]);
  }
  return sum;
}

// Each edge occurs equally often in both directions.
bool is_closed(const FacetedSolid& solid) {
  std::vector<std::pair<uint32_t, uint32_t>> forward, backward;
  for (const auto& [from, to] : solid.edges) {
    forward.emplace_back(from, to);
    backward.emplace_back(to, from);
  }
  std::ranges::sort(forward);
  std::ranges::sort(backward);
  return forward == backward;
}

size_t cap_edges(const FacetedSolid& solid) {
  size_t count = 0;
  for (const auto& face : solid.faces) count += face.is_cap ? face.edge_count : 0;
  return count;
}

TEST(MeshClip, BoxIsCutIntoBoxes) {
  const FacetedSolid box = faceted_solid(box_mesh({2, 3, 4}));
  EXPECT_NEAR(box.volume(), 24.0, 1e-12);
  const auto [below, above] = split(box, {Vec3::UnitZ(), 1.25});
  EXPECT_NEAR(below.volume(), 2 * 3 * 3.25, 1e-12);
  EXPECT_NEAR(above.volume(), 2 * 3 * 0.75, 1e-12);
  EXPECT_TRUE(is_closed(below));
  EXPECT_TRUE(is_closed(above));
}

TEST(MeshClip, PlaneBesideTheSolidLeavesItWhole) {
  const FacetedSolid box = faceted_solid(box_mesh({2, 3, 4}));
  const auto [below, above] = split(box, {Vec3::UnitX(), 5.0});
  EXPECT_NEAR(below.volume(), 24.0, 1e-12);
  EXPECT_TRUE(above.empty());
}

TEST(MeshClip, CapMayHaveAHole) {
  const FacetedSolid torus = faceted_solid(test::torus_mesh(1.0, 0.25, 24, 12));
  const auto [below, above] = split(torus, {Vec3::UnitY(), 0.01});
  EXPECT_GE(cap_edges(above), 48u);
  EXPECT_TRUE(is_closed(below));
  EXPECT_NEAR(below.volume() + above.volume(), torus.volume(), 1e-12);
  EXPECT_LT(area_vector(above).norm(), 1e-12);
  // A second cut runs through both loops of that cap: two half rings.
  const auto [left, right] = split(above, {Vec3::UnitX(), 0.0});
  EXPECT_NEAR(left.volume(), right.volume(), 1e-9);
  EXPECT_TRUE(is_closed(left));
  EXPECT_LT(area_vector(left).norm(), 1e-12);
}

TEST(MeshClip, CapMayHaveSeveralLoops) {
  const FacetedSolid torus = faceted_solid(test::torus_mesh(1.0, 0.25, 24, 12));
  const auto [below, above] = split(torus, {Vec3(1, 0, 0.1).normalized(), 0.0});
  EXPECT_NEAR(below.volume(), above.volume(), 1e-9);
  EXPECT_TRUE(is_closed(below));
}

TEST(MeshClip, VerticesOnThePlaneDoNoHarm) {
  const FacetedSolid box = faceted_solid(box_mesh({2, 2, 2}));
  const auto [below, above] = split(box, {Vec3(1, 1, 0).normalized(), 0.0});
  EXPECT_NEAR(below.volume(), 4.0, 1e-12);
  EXPECT_NEAR(above.volume(), 4.0, 1e-12);
  const auto [inside, face] = split(box, {Vec3::UnitX(), 1.0});
  EXPECT_NEAR(inside.volume(), 8.0, 1e-12);
  EXPECT_NEAR(face.volume(), 0.0, 1e-12);
}

TEST(MeshClip, RandomCutsKeepTheVolume) {
  for (const TriangleMesh& mesh :
       {test::blob_mesh(2), test::torus_mesh(1.0, 0.4, 20, 10), test::l_shape_mesh()}) {
    Philox random(1, Stream::test, 0);
    std::vector<FacetedSolid> parts{faceted_solid(mesh)};
    const double volume = parts[0].volume();
    for (int cut = 0; cut < 6; ++cut) {
      const ClipPlane plane{random.direction(), random.uniform(-0.4, 0.6)};
      std::vector<FacetedSolid> next;
      for (const FacetedSolid& part : parts) {
        SplitSolid halves = split(part, plane);
        EXPECT_NEAR(part.volume_above(plane), halves.above.volume(), 1e-12);
        for (FacetedSolid* half : {&halves.below, &halves.above}) {
          if (half->empty()) continue;
          EXPECT_TRUE(is_closed(*half));
          EXPECT_GT(half->volume(), -1e-12);
          next.push_back(std::move(*half));
        }
      }
      parts = std::move(next);
    }
    const double sum =
        std::accumulate(parts.begin(), parts.end(), 0.0,
                        [](double s, const FacetedSolid& part) { return s + part.volume(); });
    EXPECT_NEAR(sum, volume, 1e-10);
  }
}

TEST(MeshClip, UnitedHalvesCanBeCutAgain) {
  const FacetedSolid blob = faceted_solid(test::blob_mesh(2));
  const auto [below, above] = split(blob, {Vec3::UnitX(), 0.1});
  const FacetedSolid whole = united(below, above);
  EXPECT_NEAR(whole.volume(), blob.volume(), 1e-12);
  const ClipPlane plane{Vec3(1, 2, 3).normalized(), 0.2};
  EXPECT_NEAR(split(whole, plane).below.volume(), split(blob, plane).below.volume(), 1e-12);
}

}  // namespace
}  // namespace pilesim
