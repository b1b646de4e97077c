#include "geometry/solid.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <functional>
#include <thread>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/hash.h"
#include "geometry/decimation.h"
#include "geometry/inside_test.h"
#include "geometry/mass_properties.h"
#include "geometry/mesh_import.h"
#include "geometry/mesh_repair.h"
#include "geometry/obj_writer.h"
#include "geometry/surface_distance.h"
#include "geometry/triangle_tree.h"
#include "geometry/wrap.h"
#include "support/dirty_meshes.h"
#include "support/scratch_directory.h"

namespace pilesim {
namespace {

using test::joined;
using test::moved;
using test::volume;
using testing::HasSubstr;

// Volume of both meshes together, which may cross.
double volume_of_union(const TriangleMesh& a, const TriangleMesh& b) {
  const InsideTest in_a(a), in_b(b);
  Bounds box = a.bounds();
  box.extend(b.bounds());
  Philox random(1, Stream::test, 0);
  // Volume that b adds, by random points: few are enough because it is small.
  Bounds small = b.bounds();
  int added = 0;
  constexpr int kPoints = 20000;
  for (int i = 0; i < kPoints; ++i) {
    const double x = random.uniform(), y = random.uniform(), z = random.uniform();
    const Vec3 point = small.min() + small.sizes().cwiseProduct(Vec3(x, y, z));
    added += in_b.contains(point) && !in_a.contains(point);
  }
  return volume(a) + small.volume() * added / kPoints;
}

std::string refusal(const TriangleMesh& mesh, const SolidOptions& options = {}) {
  try {
    make_solid(mesh, options);
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::input);
    return error.what();
  }
  return "";
}

// A cup of one sheet, open above.
TriangleMesh cup(double radius, double height, uint32_t sides = 32) {
  TriangleMesh mesh;
  for (uint32_t i = 0; i < sides; ++i) {
    const double u = 2 * kPi * i / sides;
    mesh.vertices.emplace_back(radius * std::cos(u), 0, radius * std::sin(u));
    mesh.vertices.emplace_back(radius * std::cos(u), height, radius * std::sin(u));
  }
  mesh.vertices.emplace_back(0, 0, 0);
  for (uint32_t i = 0; i < sides; ++i) {
    const uint32_t a = 2 * i, b = 2 * ((i + 1) % sides);
    mesh.triangles.push_back({a, a + 1, b});
    mesh.triangles.push_back({b, a + 1, b + 1});
    mesh.triangles.push_back({a, b, 2 * sides});
  }
  return mesh;
}

// Each clean mesh with each kind of damage, in the units of watches and of ships.
class DirtyMesh : public testing::TestWithParam<std::tuple<size_t, size_t>> {};

TEST_P(DirtyMesh, BecomesASolidOfTheSameVolume) {
  const auto [which, how] = GetParam();
  const test::NamedMesh clean = test::clean_meshes()[which];
  const test::Dirt dirt = test::kinds_of_dirt()[how];
  const double scale = std::array{1.0, 1e-4, 1e3}[(which + how) % 3];
  SCOPED_TRACE(clean.name + ", " + dirt.name + ", times " + std::to_string(scale));
  Philox random(7, Stream::test, which, static_cast<uint32_t>(how));
  const double expected =
      dirt.adds ? volume_of_union(clean.mesh, dirt.adds(clean.mesh)) : volume(clean.mesh);

  const test::ScratchDirectory scratch;
  write_obj(dirt.make(clean.mesh, random), scratch / "dirty.obj");
  const TriangleMesh mesh = import_mesh(scratch / "dirty.obj", scale);
  const Solid solid = make_solid(mesh, {.cells = 64});
  EXPECT_EQ(find_mesh_defects(solid.mesh).size(), 0u) << solid.note;
  EXPECT_NEAR(volume(solid.mesh) / std::pow(scale, 3) / expected, 1, 0.02) << solid.note;
  EXPECT_EQ(solid.note.empty(), solid.way == SolidWay::as_it_is);
  EXPECT_LT(surface_distance(solid.mesh, mesh).mean_m, 0.01 * mesh.bounds().diagonal().norm());
}

INSTANTIATE_TEST_SUITE_P(Corpus, DirtyMesh,
                         testing::Combine(testing::Range<size_t>(0, 5),
                                          testing::Range<size_t>(0, 12)));

TEST(Repair, LeavesAProperMeshAlone) {
  for (const test::NamedMesh& clean : test::clean_meshes()) {
    const Repair repair = repair_mesh(clean.mesh);
    EXPECT_TRUE(repair.done.empty()) << clean.name << ": " << repair.done.front();
    EXPECT_EQ(mesh_hash(repair.mesh), mesh_hash(clean.mesh));
  }
}

TEST(Repair, KeepsAHollowAndDropsAPieceInside) {
  const TriangleMesh outer = sphere_mesh(1), inner = sphere_mesh(0.5);
  const TriangleMesh hollow = joined(outer, test::turned_inside_out(inner));
  EXPECT_TRUE(find_mesh_defects(hollow).empty());
  EXPECT_NEAR(volume(repair_mesh(hollow).mesh), volume(outer) - volume(inner), 1e-9);
  EXPECT_NEAR(volume(repair_mesh(joined(outer, inner)).mesh), volume(outer), 1e-9);
  // Also with all triangles reversed.
  const TriangleMesh turned = test::turned_inside_out(outer);
  EXPECT_NEAR(volume(repair_mesh(turned).mesh), volume(outer), 1e-9);
}

TEST(Repair, SaysHowLargeTheHoleWas) {
  TriangleMesh ball = sphere_mesh(1, 4);
  ball.triangles.pop_back();
  const Repair repair = repair_mesh(ball);
  ASSERT_EQ(repair.done.size(), 1u);
  EXPECT_THAT(repair.done[0], HasSubstr("1 hole closed, the largest 0.1"));
  EXPECT_TRUE(find_mesh_defects(repair.mesh).empty());
}

TEST(Wrap, ConvergesToWhatTheMeshEncloses) {
  const TriangleMesh ball = sphere_mesh(1, 5);
  double last = 1;
  for (const int cells : {32, 64, 128}) {
    const Wrap wrap = wrap_mesh(ball, {}, {.cells = cells});
    const double error = std::abs(volume(wrap.mesh) / volume(ball) - 1);
    EXPECT_LT(error, last);
    last = error;
    EXPECT_LT(surface_distance(wrap.mesh, ball).hausdorff_m, wrap.cell_m);
    EXPECT_TRUE(find_mesh_defects(wrap.mesh).empty());
  }
  EXPECT_LT(last, 3e-3);
}

TEST(Decimation, KeepsABallWhole) {
  const TriangleMesh ball = sphere_mesh(1, 5);
  size_t last = ball.triangles.size();
  for (const double error : {1e-3, 3e-3, 1e-2}) {
    const TriangleMesh fewer = decimated(ball, error);
    EXPECT_LT(fewer.triangles.size(), last);
    EXPECT_TRUE(find_mesh_defects(fewer).empty());
    EXPECT_LT(surface_distance(fewer, ball).hausdorff_m, 4 * error);
    last = fewer.triangles.size();
  }
  EXPECT_LT(last, ball.triangles.size() / 20);
}

// Three corners around the tube: for two of them the third is a common neighbour although the three
// form no triangle. If two were merged, the tube would be pinched.
TEST(Decimation, PinchesNoTube) {
  for (const double error : {0.01, 0.05, 0.2}) {
    // Self-contact is for its caller to check.
    for (const MeshDefect& defect :
         find_mesh_defects(decimated(test::torus_mesh(1, 0.1, 90, 3), error))) {
      EXPECT_EQ(defect.kind, MeshDefectKind::self_touching) << defect.text;
    }
  }
}

// Intersecting boards, as in a chair: flat parts touch at steps of the grid.
TEST(Wrap, OfFlatBoardsHasFewTriangles) {
  TriangleMesh boards = box_mesh({1, 0.1, 0.9});
  for (const double x : {-0.4, 0.4}) {
    for (const double z : {-0.35, 0.35}) {
      boards = joined(boards, moved(box_mesh({0.11, 0.8, 0.11}), {.position = {x, -0.35, z}}));
    }
  }
  boards = joined(boards, moved(box_mesh({0.9, 0.3, 0.06}), {.position = {0, 0.1, -0.4}}));
  const Solid solid = make_solid(boards, {.cells = 64});
  EXPECT_EQ(solid.way, SolidWay::wrapped);
  EXPECT_TRUE(find_mesh_defects(solid.mesh).empty());
  EXPECT_LT(solid.mesh.triangles.size(), 8000u);  // of 60,000
}

// A box without its lid: the closing surface is where half of all directions hit the box.
TEST(Wrap, ClosesAnOpeningWhereTheWindingNumberIsOneHalf) {
  TriangleMesh box = box_mesh({1, 1, 1});
  std::erase_if(box.triangles, [&](const Triangle& t) {
    return std::ranges::all_of(t, [&](uint32_t v) { return box.vertices[v].y() > 0; });
  });
  ASSERT_EQ(box.triangles.size(), 10u);
  const Wrap wrap = wrap_mesh(box, {}, {.cells = 32});
  EXPECT_TRUE(find_mesh_defects(wrap.mesh).empty());
  const InsideTest inside(box);
  const TriangleTree walls(box);
  int closing = 0;
  for (const Vec3& vertex : wrap.mesh.vertices) {
    if (walls.distance(vertex) < 4 * wrap.cell_m) continue;
    ++closing;
    EXPECT_NEAR(inside.winding_number(vertex), 0.5, 2e-3) << vertex.transpose();
  }
  EXPECT_GT(closing, 15);
  EXPECT_GT(wrap.closing_share, 0.1);
}

TEST(Wrap, UnitesPartsThatCross) {
  const TriangleMesh a = box_mesh({1, 1, 1}), b = moved(a, {.position = {0.5, 0.25, 0.125}});
  const Solid solid = make_solid(joined(a, b), {.rule = SolidRule::wrap});
  EXPECT_EQ(solid.way, SolidWay::wrapped);
  EXPECT_NEAR(volume(solid.mesh), 2 - 0.5 * 0.75 * 0.875, 0.02);
}

TEST(Solid, AMugWithItsHandlePushedIntoItsBody) {
  // Closed walls, and a bent bar whose ends end in them.
  const TriangleMesh body = cylinder_mesh(0.04, 0.1, 64);
  const TriangleMesh handle = moved(
      test::torus_mesh(0.03, 0.005, 48, 16),
      {.position = {0.045, 0, 0}, .orientation = Quat(Eigen::AngleAxisd(kPi / 2, Vec3::UnitX()))});
  const TriangleMesh mug = joined(body, handle);
  const Solid solid = make_solid(mug, {});
  EXPECT_EQ(solid.way, SolidWay::wrapped);
  EXPECT_NEAR(volume(solid.mesh) / volume_of_union(body, handle), 1, 0.02);
  EXPECT_THAT(solid.note, HasSubstr("wrapped with cells of"));
}

TEST(Solid, ASheetNeedsAThickness) {
  TriangleMesh sheet;
  for (int i = 0; i < 4; ++i)
    sheet.vertices.emplace_back(i & 1 ? 0.3 : 0, 0.02 * (i == 3), i >> 1 ? 0.2 : 0);
  sheet.triangles = {{0, 2, 1}, {1, 2, 3}};
  EXPECT_THAT(refusal(sheet), HasSubstr("thickness_m"));
  const Solid solid = make_solid(sheet, {.thickness_m = 0.01});
  EXPECT_TRUE(find_mesh_defects(solid.mesh).empty());
  // Its area times the thickness, and a half cylinder along the whole border.
  const double body = 0.3 * 0.2 * 0.01, border = kPi / 2 * 0.005 * 0.005 * 2 * (0.3 + 0.2);
  EXPECT_NEAR(volume(solid.mesh) / (body + border), 1, 0.03);
  EXPECT_THAT(refusal(sheet, {.thickness_m = 1e-5}), HasSubstr("expected at least"));
}

// With equal or different diagonals on both sides; if equal, it is a closed mesh without volume.
TEST(Solid, ASheetWithBothItsSides) {
  const std::vector<Triangle> front = {{0, 2, 1}, {1, 2, 3}};
  for (const std::vector<Triangle>& back :
       {std::vector<Triangle>{{0, 1, 2}, {1, 3, 2}}, {{0, 1, 3}, {0, 3, 2}}}) {
    TriangleMesh sheet;
    for (int i = 0; i < 4; ++i) sheet.vertices.emplace_back(i & 1 ? 0.3 : 0, 0, i >> 1 ? 0.2 : 0);
    sheet.triangles = front;
    sheet.triangles.insert(sheet.triangles.end(), back.begin(), back.end());
    EXPECT_THAT(refusal(sheet), HasSubstr("100 % of its surface encloses nothing"));
    const Solid solid = make_solid(sheet, {.thickness_m = 0.01});
    const double border = kPi / 2 * 0.005 * 0.005 * 2 * (0.3 + 0.2);
    EXPECT_NEAR(volume(solid.mesh) / (0.3 * 0.2 * 0.01 + border), 1, 0.03);
  }
}

TEST(Solid, ACupOfOneSheet) {
  const TriangleMesh mesh = cup(0.04, 0.1);
  EXPECT_THAT(refusal(mesh), HasSubstr("thickness_m"));
  const double thickness = 0.004;
  const Solid solid = make_solid(mesh, {.thickness_m = thickness, .cells = 96});
  const double area = 2 * kPi * 0.04 * 0.1 + kPi * 0.04 * 0.04;
  EXPECT_NEAR(volume(solid.mesh) / (area * thickness), 1, 0.05);
  EXPECT_FALSE(InsideTest(solid.mesh).contains({0, 0.05, 0}));
}

TEST(Solid, RulesSayWhatIsWanted) {
  TriangleMesh open = box_mesh({1, 1, 1});
  open.triangles.pop_back();
  open.triangles.pop_back();
  EXPECT_THAT(refusal(open, {.rule = SolidRule::exact}), HasSubstr("one triangle only"));
  EXPECT_THAT(refusal(open, {.cells = 64}), HasSubstr("open wide"));
  const Solid hull = make_solid(open, {.rule = SolidRule::hull});
  EXPECT_NEAR(volume(hull.mesh), 1, 1e-9);
  EXPECT_THAT(hull.note, HasSubstr("its hull"));
  const Solid wrap = make_solid(open, {.rule = SolidRule::wrap, .cells = 64});
  EXPECT_THAT(wrap.note, HasSubstr("closes openings"));
  EXPECT_GT(volume(wrap.mesh), 0.5);
  EXPECT_LT(volume(wrap.mesh), 1.05);
  const Solid exact = make_solid(box_mesh({1, 1, 1}), {.rule = SolidRule::exact});
  EXPECT_EQ(exact.way, SolidWay::as_it_is);
}

TEST(Solid, IsTheSameEachTime) {
  const TriangleMesh crossing =
      joined(sphere_mesh(1, 3), moved(sphere_mesh(0.7, 3), {.position = {0.8, 0.1, 0.2}}));
  EXPECT_EQ(mesh_hash(make_solid(crossing, {.cells = 48}).mesh),
            mesh_hash(make_solid(crossing, {.cells = 48}).mesh));
}

class SolidCacheTest : public testing::Test {
 protected:
  Solid run() const { return make_solid(mesh_, options_, scratch_ / "deep"); }
  std::vector<std::filesystem::path> files() const {
    std::vector<std::filesystem::path> result;
    for (const auto& entry : std::filesystem::directory_iterator(scratch_ / "deep")) {
      result.push_back(entry.path());
    }
    return result;
  }

  test::ScratchDirectory scratch_;
  TriangleMesh mesh_ =
      joined(box_mesh({1, 1, 1}), moved(box_mesh({1, 1, 1}), {.position = {0.5, 0.25, 0.125}}));
  SolidOptions options_{.cells = 16};
};

void expect_same(const Solid& a, const Solid& b) {
  EXPECT_EQ(a.mesh.vertices, b.mesh.vertices);
  EXPECT_EQ(a.mesh.triangles, b.mesh.triangles);
  EXPECT_EQ(a.way, b.way);
  EXPECT_EQ(a.note, b.note);
}

TEST_F(SolidCacheTest, GivesBackWhatWasWrappedOrMended) {
  const Solid wrap = run();
  EXPECT_EQ(wrap.way, SolidWay::wrapped);
  EXPECT_FALSE(wrap.from_cache);
  EXPECT_TRUE(run().from_cache);
  expect_same(wrap, run());
  mesh_ = box_mesh({1, 1, 1});
  mesh_.triangles.push_back(mesh_.triangles.front());
  const Solid mended = run();
  EXPECT_EQ(mended.way, SolidWay::repaired);
  EXPECT_TRUE(run().from_cache);
  expect_same(mended, run());
}

TEST_F(SolidCacheTest, OtherMeshesAndOptionsAreOtherEntries) {
  run();
  for (const auto& change : std::vector<std::function<void()>>{
           [this] { options_.cells = 17; }, [this] { options_.rule = SolidRule::wrap; },
           [this] { options_.thickness_m = 0.2; }, [this] { mesh_.vertices[0].x() -= 0.1; },
           [this] { mesh_.rounding_m = 1e-9; },
           [this] {
             mesh_.groups = {{"all", 0, 24}};
           }}) {
    const size_t before = files().size();
    change();
    EXPECT_FALSE(run().from_cache);
    EXPECT_EQ(files().size(), before + 1);
  }
}

TEST_F(SolidCacheTest, ProperSolidsAreNotCached) {
  mesh_ = box_mesh({1, 1, 1});
  EXPECT_EQ(run().way, SolidWay::as_it_is);
  options_.rule = SolidRule::hull;
  EXPECT_EQ(run().way, SolidWay::hull);
  EXPECT_FALSE(std::filesystem::exists(scratch_ / "deep"));
}

TEST_F(SolidCacheTest, DamagedFilesAreReplaced) {
  const Solid made = run();
  const std::filesystem::path file = files().front();
  const std::string whole = read_file(file);
  std::string flipped = whole;
  flipped[whole.size() / 2] ^= 0x10;
  // With a valid digest, but from another program.
  const std::string other = "\xa1\x61x\x01";
  for (const std::string& damaged :
       {flipped, whole.substr(0, whole.size() / 2), std::string(), whole.substr(0, 32),
        std::string("no cache at all"), content_hash(other) + other}) {
    write_file_atomically(file, damaged);
    const Solid again = run();
    EXPECT_FALSE(again.from_cache);
    expect_same(made, again);
    EXPECT_EQ(read_file(file), whole);
  }
}

TEST_F(SolidCacheTest, SeveralMakersAtOnceLeaveOneWholeFile) {
  std::vector<Solid> solids(4);
  {
    std::vector<std::jthread> makers;
    for (Solid& solid : solids) makers.emplace_back([&] { solid = run(); });
  }
  for (const Solid& solid : solids) expect_same(solids.front(), solid);
  EXPECT_EQ(files().size(), 1u);
  EXPECT_TRUE(run().from_cache);
  expect_same(solids.front(), run());
}

}  // namespace
}  // namespace pilesim
