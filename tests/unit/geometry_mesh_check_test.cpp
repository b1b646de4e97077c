#include "geometry/mesh_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>

#include "../geometry_shapes.h"
#include "geometry/primitives.h"

namespace pilesim {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::vector<MeshDefectKind> kinds(const std::vector<MeshDefect>& defects) {
  std::vector<MeshDefectKind> kinds;
  for (const MeshDefect& defect : defects) kinds.push_back(defect.kind);
  return kinds;
}

void expect_only(const TriangleMesh& mesh, MeshDefectKind kind, size_t count,
                 const std::string& text) {
  const std::vector<MeshDefect> defects = find_mesh_defects(mesh);
  ASSERT_THAT(kinds(defects), ElementsAre(kind));
  EXPECT_EQ(defects[0].count, count);
  EXPECT_THAT(defects[0].text, HasSubstr(text));
}

TriangleMesh at(const TriangleMesh& mesh, const Vec3& position) {
  return test::moved(mesh, {.position = position});
}

TEST(MeshCheck, AcceptsSolids) {
  for (const TriangleMesh& mesh :
       {box_mesh({1, 2, 3}), sphere_mesh(1, 4), cylinder_mesh(0.1, 3),
        test::torus_mesh(1, 0.3, 40, 20), box_mesh({1, 1e-4, 1}), box_mesh({1e-6, 1e-6, 1e-6}),
        at(sphere_mesh(1), {1e4, 1e4, 1e4})}) {
    for (const MeshDefect& defect : find_mesh_defects(mesh)) ADD_FAILURE() << defect.text;
  }
}

TEST(MeshCheck, AcceptsSeveralPiecesAndCavities) {
  const TriangleMesh hollow =
      test::joined(sphere_mesh(1), test::turned_inside_out(sphere_mesh(0.9)));
  for (const TriangleMesh& mesh :
       {test::joined(box_mesh({1, 1, 1}), at(box_mesh({1, 1, 1}), {1.01, 0, 0})), hollow,
        test::joined(hollow, sphere_mesh(0.5))}) {
    for (const MeshDefect& defect : find_mesh_defects(mesh)) ADD_FAILURE() << defect.text;
  }
}

TEST(MeshCheck, Empty) {
  expect_only({}, MeshDefectKind::empty, 1, "no triangles");
  expect_only({.vertices = {{1, 1, 1}}, .triangles = {{0, 0, 0}}}, MeshDefectKind::empty, 1,
              "one point");
}

TEST(MeshCheck, HoleIsAnOpenEdge) {
  TriangleMesh mesh = box_mesh({2, 2, 2});
  mesh.triangles.pop_back();  // (4, 7, 6)
  expect_only(mesh, MeshDefectKind::open_edge, 3,
              "edge (4, 6) from (-1, -1, 1) to (-1, 1, 1) has one triangle only (0): the surface "
              "is open there; 3 open edges in all");
}

TEST(MeshCheck, FinIsANonManifoldEdge) {
  TriangleMesh mesh = box_mesh({2, 2, 2});
  mesh.vertices.emplace_back(3, 3, 3);
  mesh.triangles.push_back({6, 7, 8});
  const std::vector<MeshDefect> defects = find_mesh_defects(mesh);
  ASSERT_THAT(kinds(defects), ElementsAre(MeshDefectKind::open_edge, MeshDefectKind::non_manifold));
  EXPECT_THAT(defects[1].text,
              HasSubstr("edge (6, 7) from (-1, 1, 1) to (1, 1, 1) has 3 triangles"));
}

TEST(MeshCheck, FlippedTriangleIsInconsistent) {
  TriangleMesh mesh = sphere_mesh(1, 1);
  std::swap(mesh.triangles[7][1], mesh.triangles[7][2]);
  expect_only(mesh, MeshDefectKind::inconsistent, 3, "and 7)");
}

TEST(MeshCheck, DegenerateTriangle) {
  // A vertex splits the edge (0, 1) of a tetrahedron, with a flat triangle on one side.
  const TriangleMesh mesh{
      .vertices = {{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {0, 0, 2}, {1, 0, 0}},
      .triangles = {{0, 2, 4}, {4, 2, 1}, {0, 1, 3}, {0, 4, 1}, {1, 2, 3}, {0, 3, 2}}};
  expect_only(mesh, MeshDefectKind::degenerate, 1,
              "triangle 3 (vertices 0, 4, 1) at (1, 0, 0) has no area");
}

TEST(MeshCheck, InsideOut) {
  expect_only(test::turned_inside_out(box_mesh({1, 2, 3})), MeshDefectKind::inside_out, 1,
              "all triangles face inward: the volume is -6 m^3");
  // The total volume is still positive.
  expect_only(test::joined(box_mesh({2, 2, 2}),
                           at(test::turned_inside_out(box_mesh({1, 1, 1})), {5, 0, 0})),
              MeshDefectKind::inside_out, 1, "faces inward");
}

TEST(MeshCheck, PieceInsideAnotherCountsTwice) {
  expect_only(test::joined(box_mesh({2, 2, 2}), box_mesh({1, 1, 1})), MeshDefectKind::self_touching,
              1, "lies inside another one");
}

TEST(MeshCheck, CrossingPieces) {
  const std::vector<MeshDefect> defects =
      find_mesh_defects(test::joined(sphere_mesh(1), at(sphere_mesh(1), {0.5, 0.31, 0.17})));
  ASSERT_THAT(kinds(defects), ElementsAre(MeshDefectKind::self_touching));
  EXPECT_GT(defects[0].count, 50u);
  EXPECT_THAT(defects[0].text, HasSubstr("touches or crosses"));
}

TEST(MeshCheck, TouchingPieces) {
  const TriangleMesh big = box_mesh({2, 2, 2}), small = box_mesh({1, 1, 1});
  const auto find = [&](double gap) {
    return kinds(find_mesh_defects(test::joined(big, at(small, {1.5 + gap, 0.1, 0.2}))));
  };
  EXPECT_THAT(find(0), ElementsAre(MeshDefectKind::self_touching)) << "face on face";
  EXPECT_THAT(find(1e-9), ElementsAre());
  EXPECT_THAT(find(-1e-9), ElementsAre(MeshDefectKind::self_touching));

  TriangleMesh spike{.vertices = {{0, 0, 1}, {1, 0, 3}, {-1, 1, 3}, {-1, -1, 3}},
                     .triangles = {{0, 2, 1}, {0, 3, 2}, {0, 1, 3}, {1, 2, 3}}};
  EXPECT_THAT(kinds(find_mesh_defects(test::joined(big, at(spike, {0.1, 0.3, 0})))),
              ElementsAre(MeshDefectKind::self_touching))
      << "vertex on face";
  EXPECT_THAT(kinds(find_mesh_defects(test::joined(big, at(spike, {0.1, 0.3, 1e-6})))),
              ElementsAre());
}

TEST(MeshCheck, ATubeThroughItself) {
  // A torus whose tube is thicker than its ring: the inner sides cross on the axis.
  const std::vector<MeshDefect> defects = find_mesh_defects(test::torus_mesh(0.5, 0.7, 41, 23));
  EXPECT_THAT(kinds(defects), ElementsAre(MeshDefectKind::self_touching));
}

TEST(MeshCheck, NeighboursThatCrossBesideTheirVertex) {
  // A corner of a fine sphere is pulled through the opposite side.
  TriangleMesh mesh = sphere_mesh(1, 2);
  const Vec3 pulled = mesh.vertices[0];
  mesh.vertices[0] = -1.5 * pulled;
  EXPECT_THAT(kinds(find_mesh_defects(mesh)), ElementsAre(MeshDefectKind::self_touching));

  // Two triangles that share only vertex 0: the tetrahedron's far edge passes through the other's
  // side.
  TriangleMesh blades{
      .vertices = {{0, 0, 0},
                   {4, -1, 0},
                   {4, 1, 0},
                   {4, 0, 1},
                   {3, 0, 0.3},
                   {5, 0.1, -0.3},
                   {5, -0.1, -0.4}},
      .triangles = {
          {0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}, {0, 4, 5}, {0, 5, 6}, {0, 6, 4}, {4, 6, 5}}};
  std::vector<MeshDefect> defects = find_mesh_defects(blades);
  if (!defects.empty() && defects[0].kind == MeshDefectKind::inside_out) {
    for (size_t i = 4; i < 8; ++i) std::swap(blades.triangles[i][1], blades.triangles[i][2]);
    defects = find_mesh_defects(blades);
  }
  EXPECT_THAT(kinds(defects), ElementsAre(MeshDefectKind::self_touching));
}

TEST(MeshCheck, SheetFoldedOntoItself) {
  // A double triangle: closed, without volume.
  const TriangleMesh sheet{.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.3, 0.3, 0}},
                           .triangles = {{0, 1, 3}, {1, 2, 3}, {2, 0, 3}, {0, 2, 1}}};
  EXPECT_THAT(kinds(find_mesh_defects(sheet)), ElementsAre(MeshDefectKind::self_touching));
}

TEST(MeshCheck, FlatGridsAreNotTouching) {
  // Fine flat sides: all neighbours are coplanar.
  TriangleMesh mesh = box_mesh({1, 1, 1});
  for (int level = 0; level < 4; ++level) {  // each triangle becomes four
    TriangleMesh fine{.vertices = mesh.vertices, .triangles = {}, .groups = {}};
    std::map<std::pair<uint32_t, uint32_t>, uint32_t> middles;
    const auto middle = [&](uint32_t a, uint32_t b) {
      const auto [place, is_new] =
          middles.try_emplace(std::minmax(a, b), static_cast<uint32_t>(fine.vertices.size()));
      if (is_new) fine.vertices.push_back((fine.vertices[a] + fine.vertices[b]) / 2);
      return place->second;
    };
    for (const auto& [a, b, c] : mesh.triangles) {
      const uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      fine.triangles.insert(fine.triangles.end(),
                            {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
    }
    mesh = fine;
  }
  for (uint64_t trial = 0; trial < 5; ++trial) {
    Philox random(51, Stream::test, trial);
    for (const MeshDefect& d :
         find_mesh_defects(test::moved(mesh, test::random_pose(random, 10)))) {
      ADD_FAILURE() << d.text;
    }
  }
}

TEST(MeshCheck, VolumesMayTouchButNotLieInOneAnother) {
  TriangleMesh other = box_mesh({1, 1, 1});
  const auto beside = [&](double x) {
    TriangleMesh moved = other;
    for (Vec3& v : moved.vertices) v.x() += x;
    return test::joined(box_mesh({2, 2, 2}), moved);
  };
  EXPECT_THAT(find_volume_defects(beside(1)), testing::IsEmpty());  // crossing
  EXPECT_THAT(find_volume_defects(beside(5)), testing::IsEmpty());
  EXPECT_THAT(kinds(find_volume_defects(beside(0.1))), ElementsAre(MeshDefectKind::self_touching));
  other.triangles.pop_back();
  EXPECT_THAT(kinds(find_volume_defects(beside(1))), ElementsAre(MeshDefectKind::open_edge));
}

}  // namespace
}  // namespace pilesim
