#include "geometry/half_edges.h"

#include <gtest/gtest.h>

#include <map>
#include <set>
#include <vector>

#include "core/philox.h"
#include "geometry/mesh_group.h"
#include "geometry/primitives.h"

namespace pilesim {
namespace {

// Triangles that share edges at random, some of them twice or with a corner that stands twice.
TEST(HalfEdges, AreThoseThatASearchFinds) {
  for (uint64_t trial = 0; trial < 20; ++trial) {
    Philox random(23, Stream::test, trial);
    constexpr uint32_t kVertices = 12;
    std::vector<Triangle> triangles;
    for (int i = 0; i < 40; ++i) {
      Triangle triangle;
      for (uint32_t& vertex : triangle) vertex = static_cast<uint32_t>(random.index(kVertices));
      triangles.push_back(triangle);
    }
    std::map<std::pair<uint32_t, uint32_t>, std::vector<std::pair<uint32_t, int>>> expected;
    for (uint32_t t = 0; t < triangles.size(); ++t) {
      for (int k = 0; k < 3; ++k) {
        const uint32_t from = triangles[t][static_cast<size_t>(k)];
        const uint32_t to = triangles[t][static_cast<size_t>((k + 1) % 3)];
        expected[std::minmax(from, to)].emplace_back(t, k);
      }
    }
    const HalfEdges sides(triangles, kVertices);
    size_t edges = 0;
    sides.for_each_edge([&](std::span<const HalfEdge> edge) {
      ++edges;
      const auto& all = expected.at({edge[0].low, edge[0].high});
      ASSERT_EQ(edge.size(), all.size());
      for (size_t i = 0; i < edge.size(); ++i) {
        EXPECT_EQ(edge[i].triangle, all[i].first);
        EXPECT_EQ(edge[i].corner, all[i].second);
        const uint32_t from = triangles[edge[i].triangle][edge[i].corner];
        EXPECT_EQ(edge[i].forward ? edge[i].low : edge[i].high, from);
      }
    });
    EXPECT_EQ(edges, expected.size());
    for (uint32_t a = 0; a < kVertices; ++a) {
      for (uint32_t b = 0; b < kVertices; ++b) {
        const auto found = expected.find(std::minmax(a, b));
        EXPECT_EQ(sides.along(a, b).size(), found == expected.end() ? 0 : found->second.size());
      }
    }
  }
}

TEST(MeshGroups, HaveTheirOwnVerticesInTheOrderOfTheirUse) {
  TriangleMesh mesh = box_mesh({1, 2, 3});
  mesh.groups = {{"a", 0, 2}, {"none", 2, 0}, {"b", 2, 10}};
  const TriangleMesh a = group_mesh(mesh, mesh.groups[0]);
  ASSERT_EQ(a.triangles.size(), 2);
  EXPECT_EQ(a.vertices.size(), 4);
  for (size_t i = 0; i < 2; ++i) {
    for (size_t k = 0; k < 3; ++k) {
      EXPECT_EQ(a.vertices[a.triangles[i][k]], mesh.vertices[mesh.triangles[i][k]]);
    }
  }
  EXPECT_EQ(a.triangles[0], (Triangle{0, 1, 2}));
  EXPECT_TRUE(group_mesh(mesh, mesh.groups[1]).vertices.empty());
  EXPECT_EQ(group_mesh(mesh, mesh.groups[2]).triangles.size(), 10);
}

}  // namespace
}  // namespace pilesim
