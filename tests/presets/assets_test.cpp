// The committed meshes that users load. Each is a proper solid of the stated size, and the
// generator gives the same bytes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "geometry/mass_properties.h"
#include "geometry/mesh_check.h"
#include "geometry/mesh_import.h"

namespace pilesim {
namespace {

namespace fs = std::filesystem;

const fs::path kAssets = fs::path(PILESIM_SOURCE_DIR) / "assets";

struct Asset {
  std::string file;
  Vec3 size;    // of the bounding box, m
  bool stands;  // on y = 0
};

// Names the tests.
void PrintTo(const Asset& asset, std::ostream* out) { *out << asset.file; }

std::string read(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

// The groups of a mesh, each with the vertices it uses.
std::vector<TriangleMesh> split_by_group(const TriangleMesh& mesh) {
  std::vector<MeshGroup> groups = mesh.groups;
  if (groups.empty()) groups.push_back({"", 0, static_cast<uint32_t>(mesh.triangles.size())});
  std::vector<TriangleMesh> parts;
  for (const MeshGroup& group : groups) {
    TriangleMesh part;
    std::map<uint32_t, uint32_t> renumbered;
    for (uint32_t i = 0; i < group.triangle_count; ++i) {
      Triangle triangle = mesh.triangles[group.first_triangle + i];
      for (uint32_t& vertex : triangle) {
        const auto [place, fresh] =
            renumbered.emplace(vertex, static_cast<uint32_t>(part.vertices.size()));
        if (fresh) part.vertices.push_back(mesh.vertices[vertex]);
        vertex = place->second;
      }
      part.triangles.push_back(triangle);
    }
    parts.push_back(std::move(part));
  }
  return parts;
}

// Largest distance of vertices outside the planes of triangles, m; 0 for a convex mesh.
double concavity(const TriangleMesh& mesh) {
  double deepest = 0;
  for (const Triangle& triangle : mesh.triangles) {
    const Vec3& a = mesh.vertices[triangle[0]];
    const Vec3 normal =
        (mesh.vertices[triangle[1]] - a).cross(mesh.vertices[triangle[2]] - a).normalized();
    for (const Vec3& vertex : mesh.vertices) deepest = std::max(deepest, normal.dot(vertex - a));
  }
  return deepest;
}

class AssetTest : public testing::TestWithParam<Asset> {
 protected:
  TriangleMesh mesh = import_mesh(kAssets / GetParam().file);
};

TEST_P(AssetTest, EachPieceIsAProperSolid) {
  for (const TriangleMesh& part : split_by_group(mesh)) {
    std::string defects;
    for (const MeshDefect& defect : find_mesh_defects(part)) defects += defect.text + "\n";
    EXPECT_EQ(defects, "");
    EXPECT_GT(mass_properties(part).volume_m3, 0);
  }
}

TEST_P(AssetTest, HasItsNaturalSize) {
  const Bounds bounds = mesh.bounds();
  // The sculpted ones follow their design within a few per cent.
  const Vec3 ratio = bounds.sizes().cwiseQuotient(GetParam().size);
  EXPECT_THAT(ratio, testing::Each(testing::DoubleNear(1, 0.03))) << bounds.sizes().transpose();
  if (GetParam().stands) {
    EXPECT_NEAR(bounds.min().y(), 0, 2e-3);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Assets, AssetTest,
    testing::Values(
        Asset{"box.obj", {0.2, 0.2, 0.2}, false}, Asset{"l_shape.obj", {0.14, 0.2, 0.06}, true},
        Asset{"ring.obj", {0.3, 0.04, 0.3}, false}, Asset{"cross.obj", {1.5, 1.5, 0.2}, false},
        Asset{"pole.obj", {0.4, 1.5, 0.4}, true}, Asset{"stick.obj", {1, 0.02, 0.02}, false},
        Asset{"playing_card.obj", {0.063, 0.0003, 0.088}, false},
        Asset{"book.obj", {0.17, 0.03, 0.24}, false},
        Asset{"banana.obj", {0.212, 0.078, 0.036}, false},
        Asset{"chair.obj", {0.446, 0.9, 0.501}, true}, Asset{"tyre.obj", {0.65, 0.2, 0.65}, false},
        Asset{"crate.obj", {1.2, 0.815, 0.9}, true}, Asset{"cart.obj", {2, 0.98, 1.24}, true},
        Asset{"rabbit.obj", {0.3, 0.284, 0.147}, true},
        Asset{"rabbit_500.obj", {0.3, 0.284, 0.147}, true},
        Asset{"rabbit_50.obj", {0.3, 0.284, 0.147}, true},
        Asset{"biped.obj", {0.342, 0.4, 0.298}, true},
        Asset{"biped_500.obj", {0.32, 0.4, 0.3}, true},
        Asset{"biped_50.obj", {0.32, 0.4, 0.3}, true}, Asset{"guides/cone.obj", {2, 2, 2}, true},
        Asset{"guides/column.obj", {0.8, 2, 0.8}, true},
        Asset{"guides/cut_sphere.obj", {1.6, 1.4, 1.6}, true},
        Asset{"guides/l.obj", {1.6, 2, 0.6}, true}, Asset{"guides/t.obj", {2, 2, 0.6}, true},
        Asset{"guides/arch.obj", {2.2, 1.9, 0.6}, true},
        Asset{"guides/torus.obj", {2.1, 2.04, 0.6}, true},
        Asset{"guides/spiral_tower.obj", {2.74, 2.8, 2.63}, true},
        Asset{"guides/heart.obj", {2.2, 2, 0.88}, true},
        Asset{"guides/letters.obj", {4.3, 2, 0.6}, true}),
    [](const auto& test) { return fs::path(test.param.file).stem().string(); });

class GroupedAssetTest : public testing::TestWithParam<std::pair<std::string, size_t>> {};

// The loader uses such groups as collision pieces, unchanged.
TEST_P(GroupedAssetTest, IsMadeOfConvexParts) {
  const auto& [name, count] = GetParam();
  const auto parts = split_by_group(import_mesh(kAssets / name));
  EXPECT_EQ(parts.size(), count);
  for (const TriangleMesh& part : parts) EXPECT_LT(concavity(part), 2e-6);
}

INSTANTIATE_TEST_SUITE_P(Assets, GroupedAssetTest,
                         testing::Values(std::pair{"box.obj", 1}, std::pair{"stick.obj", 1},
                                         std::pair{"playing_card.obj", 1},
                                         std::pair{"l_shape.obj", 2}, std::pair{"cross.obj", 5},
                                         std::pair{"pole.obj", 2}, std::pair{"book.obj", 4},
                                         std::pair{"chair.obj", 10}, std::pair{"crate.obj", 29},
                                         std::pair{"cart.obj", 21}),
                         [](const auto& test) {
                           return fs::path(test.param.first).stem().string();
                         });

TEST(Assets, FiguresHaveTheirTriangleCounts) {
  for (const std::string figure : {"rabbit", "biped"}) {
    EXPECT_EQ(import_mesh(kAssets / (figure + ".obj")).triangles.size(), 5000);
    EXPECT_EQ(import_mesh(kAssets / (figure + "_500.obj")).triangles.size(), 500);
    EXPECT_EQ(import_mesh(kAssets / (figure + "_50.obj")).triangles.size(), 50);
  }
}

// V - E + F of a closed surface without handles is 2.
TEST(Assets, FiguresHaveNoHandles) {
  for (const char* name : {"rabbit.obj", "rabbit_500.obj", "rabbit_50.obj", "biped.obj",
                           "biped_500.obj", "biped_50.obj"}) {
    const TriangleMesh mesh = import_mesh(kAssets / name);
    EXPECT_EQ(mesh.vertices.size(), mesh.triangles.size() / 2 + 2) << name;
  }
}

TEST(Assets, TheRingFallsAroundThePole) {
  double hole = 1;
  for (const Vec3& vertex : import_mesh(kAssets / "ring.obj").vertices) {
    hole = std::min(hole, std::hypot(vertex.x(), vertex.z()));
  }
  const TriangleMesh pole = import_mesh(kAssets / "pole.obj");
  double shaft = 0;
  for (const Vec3& vertex : pole.vertices) {
    if (vertex.y() > 0.04) shaft = std::max(shaft, std::hypot(vertex.x(), vertex.z()));
  }
  EXPECT_GT(hole, 2 * shaft);
}

TEST(Assets, GeneratingThemAgainGivesTheSameBytes) {
  const fs::path again = fs::path(testing::TempDir()) / "pilesim_assets_again";
  fs::remove_all(again);
  const std::string command =
      std::string(PILESIM_GENERATE_ASSETS) + " '" + again.string() + "' 2>&1";
  ASSERT_EQ(std::system(command.c_str()), 0);
  std::vector<std::string> made;
  std::vector<std::string> committed;
  for (const auto& entry : fs::recursive_directory_iterator(again)) {
    if (entry.is_regular_file()) made.push_back(fs::relative(entry.path(), again));
  }
  for (const auto& entry : fs::recursive_directory_iterator(kAssets)) {
    if (entry.path().extension() == ".obj")
      committed.push_back(fs::relative(entry.path(), kAssets));
  }
  EXPECT_THAT(made, testing::UnorderedElementsAreArray(committed));
  for (const std::string& file : made) {
    EXPECT_TRUE(read(again / file) == read(kAssets / file)) << file << " differs";
  }
  fs::remove_all(again);
}

}  // namespace
}  // namespace pilesim
