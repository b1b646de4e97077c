#include "render/render_mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "support/render_fixture.h"

namespace pilesim {
namespace {

RenderMesh of(const TrajectoryShape& shape) {
  return make_render_mesh(shape.vertices, shape.triangles);
}

Vec3f vec(const std::array<float, 3>& v) { return {v[0], v[1], v[2]}; }

const RenderVertex& corner(const RenderMesh& mesh, const MeshLevel& level, size_t i) {
  return mesh.vertices[level.first_vertex + mesh.indices[level.first_index + i]];
}

TEST(RenderMesh, ACubeHasCreases) {
  const RenderMesh mesh = of(test::cube_shape(0.4f));
  EXPECT_TRUE(mesh.closed);
  EXPECT_NEAR(mesh.radius_m, 0.2 * std::sqrt(3.0), 1e-6);
  EXPECT_EQ(mesh.levels[0].index_count, 36u);
  EXPECT_EQ(mesh.vertices.size(), 24u);  // three normals at each corner
  for (const RenderVertex& v : mesh.vertices) {
    EXPECT_NEAR(vec(v.normal).cwiseAbs().maxCoeff(), 1, 1e-6);
    EXPECT_GT(vec(v.normal).dot(vec(v.position)), 0);  // outwards
  }
}

TEST(RenderMesh, ASphereIsSmooth) {
  const RenderMesh mesh = of(test::sphere_shape(0.5f, 24));
  EXPECT_TRUE(mesh.closed);
  EXPECT_NEAR(mesh.radius_m, 0.5, 1e-6);
  for (const RenderVertex& v : mesh.vertices) {
    EXPECT_GT(vec(v.normal).dot(vec(v.position).normalized()), std::cos(radians(3)));
  }
}

// Cauchy's mean chord, 4 V / S: of a cube two thirds of its edge, of a ball of its diameter.
TEST(RenderMesh, KnowsTheMeanWayThroughIt) {
  EXPECT_NEAR(of(test::cube_shape(0.4f)).mean_chord_m, 0.4 * 2 / 3, 1e-6);
  EXPECT_NEAR(of(test::sphere_shape(0.5f, 48)).mean_chord_m, 2 / 3.0, 2e-3);
  TrajectoryShape open = test::cube_shape(0.4f);
  open.triangles.pop_back();
  EXPECT_EQ(of(open).mean_chord_m, 0);
}

TEST(RenderMesh, VerticesAtOnePlaceAreOne) {
  TrajectoryShape soup{.name = "soup"};
  const TrajectoryShape sphere = test::sphere_shape(0.5f, 12);
  for (const auto& triangle : sphere.triangles) {
    const auto first = static_cast<uint32_t>(soup.vertices.size());
    for (const uint32_t i : triangle) soup.vertices.push_back(sphere.vertices[i]);
    soup.triangles.push_back({first, first + 1, first + 2});
  }
  const RenderMesh mesh = of(soup);
  EXPECT_TRUE(mesh.closed);
  EXPECT_EQ(mesh.levels[0].index_count, of(sphere).levels[0].index_count);
}

TEST(RenderMesh, MissingOrTurnedTrianglesLeaveItOpen) {
  TrajectoryShape hole = test::cube_shape(1);
  hole.triangles.pop_back();
  EXPECT_FALSE(of(hole).closed);
  TrajectoryShape turned = test::cube_shape(1);
  std::swap(turned.triangles[3][0], turned.triangles[3][1]);
  EXPECT_FALSE(of(turned).closed);
}

TEST(RenderMesh, NothingToDrawIsOneEmptyLevel) {
  const RenderMesh mesh = make_render_mesh({}, {});
  ASSERT_EQ(mesh.levels.size(), 1u);
  EXPECT_EQ(mesh.levels[0].index_count, 0u);
}

// The distance of points from the sphere of radius 0.5 m is the error of a simplified level.
TEST(RenderMesh, LevelsHalveAndStayWithinTheirError) {
  const RenderMesh mesh = of(test::sphere_shape(0.5f, 48));
  ASSERT_GE(mesh.levels.size(), 5u);
  const float full_error = 0.5f * (1 - std::cos(static_cast<float>(kPi) / 48));
  for (size_t l = 1; l < mesh.levels.size(); ++l) {
    const MeshLevel& level = mesh.levels[l];
    EXPECT_LE(level.index_count, 0.9 * mesh.levels[l - 1].index_count);
    EXPECT_GE(level.error_m, mesh.levels[l - 1].error_m);
    float farthest = 0;
    for (size_t i = 0; i < level.index_count; i += 3) {
      Vec3f middle = Vec3f::Zero();
      for (size_t k = 0; k < 3; ++k) middle += vec(corner(mesh, level, i + k).position) / 3;
      farthest = std::max(farthest, 0.5f - middle.norm());
    }
    // The error is the simplifier's estimate, a mean over each vertex's planes.
    EXPECT_LE(farthest, 2.5f * level.error_m + full_error) << "level " << l;
  }
}

}  // namespace
}  // namespace pilesim
