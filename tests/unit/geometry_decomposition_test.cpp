#include "geometry/convex_decomposition.h"

#include <gmock/gmock.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>

#include "../geometry_shapes.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "geometry/convex_hull.h"
#include "geometry/decomposition_cache.h"
#include "geometry/mass_properties.h"
#include "geometry/mesh_check.h"
#include "geometry/primitives.h"
#include "support/geometry_concave_shapes.h"

namespace pilesim {
namespace {

using test::blob_mesh;
using test::l_shape_mesh;
using test::scaled;
using test::volume;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Lt;
using testing::SizeIs;

double volume_sum(const std::vector<TriangleMesh>& pieces) {
  double sum = 0;
  for (const TriangleMesh& piece : pieces) sum += volume(piece);
  return sum;
}

void expect_convex_pieces(const Decomposition& decomposition, int max_vertices) {
  for (const TriangleMesh& piece : decomposition.pieces) {
    EXPECT_THAT(find_mesh_defects(piece), IsEmpty());
    EXPECT_LE(piece.vertices.size(), static_cast<size_t>(max_vertices));
    const double volume_m3 = volume(piece);
    EXPECT_GT(volume_m3, 0);
    EXPECT_NEAR(volume(convex_hull(piece.vertices)), volume_m3,
                1e-9 * decomposition.mesh_volume_m3);
  }
}

TEST(Decomposition, ConvexMeshIsOnePiece) {
  const TriangleMesh cube = box_mesh({1, 2, 3});
  const Decomposition result = decompose(cube, {}, std::nullopt);
  ASSERT_THAT(result.pieces, SizeIs(1));
  EXPECT_THAT(result.pieces[0].vertices, SizeIs(8));
  EXPECT_NEAR(volume(result.pieces[0]), 6.0, 1e-12);
  EXPECT_DOUBLE_EQ(result.mesh_volume_m3, 6.0);
  EXPECT_LT(result.volume_error(), 1e-9);
  EXPECT_LT(result.surface_error_m, 1e-9);
  EXPECT_FALSE(result.from_groups);
  EXPECT_FALSE(result.from_cache);
}

TEST(Decomposition, LShapeIsTwoBoxes) {
  const Decomposition result = decompose(l_shape_mesh(), {}, std::nullopt);
  ASSERT_THAT(result.pieces, SizeIs(2));
  EXPECT_LT(result.volume_error(), 1e-5);
  EXPECT_NEAR(result.union_volume_m3, 3.0, 1e-3);
  EXPECT_NEAR(volume_sum(result.pieces), 3.0, 1e-5);
  EXPECT_LT(result.surface_error_m, 1e-4);
}

TEST(Decomposition, TorusIsWithinTheErrorAskedFor) {
  const DecompositionOptions options;
  const TriangleMesh torus = test::torus_mesh(1.0, 0.3, 32, 16);
  const Decomposition result = decompose(torus, options, std::nullopt);
  EXPECT_LE(result.pieces.size(), 32u);
  EXPECT_LE(result.volume_error(), 0.05);
  EXPECT_NEAR(result.mesh_volume_m3, volume(torus), 1e-12);
  // The pieces hardly overlap.
  EXPECT_NEAR(volume_sum(result.pieces), result.union_volume_m3, 0.003 * result.mesh_volume_m3);
  EXPECT_NEAR(result.union_volume_m3 - result.excess_volume_m3 + result.missing_volume_m3,
              result.mesh_volume_m3, 0.001 * result.mesh_volume_m3);
  // Fitted pieces may leave slits between them, at most as deep as the middle of the tube.
  EXPECT_LE(result.surface_error_m, 0.3);
  EXPECT_LT(result.mean_surface_error_m, 0.01);
  EXPECT_LT(result.mean_surface_error_m, result.surface_error_m);
  expect_convex_pieces(result, options.max_piece_vertices);
}

// A beam of 400 x 120 mm with a notch in its upper side, of the given thickness. (For a thin-walled
// tube, or a ring sliced from it, no first cut saves anything.)
TriangleMesh notched_beam(double thickness, double from, double to, double depth) {
  constexpr double kEnd = 0.4, kTop = 0.12;
  const double floor = kTop - depth;
  const std::vector<std::pair<double, double>> outline = {
      {0, 0},     {from, 0},   {to, 0},       {kEnd, 0},    {kEnd, kTop},
      {to, kTop}, {to, floor}, {from, floor}, {from, kTop}, {0, kTop}};
  const auto count = static_cast<uint32_t>(outline.size());
  TriangleMesh mesh;
  for (const double z : {0.0, thickness}) {
    for (const auto& [x, y] : outline) mesh.vertices.emplace_back(x, y, z);
  }
  for (uint32_t k = 0; k < count; ++k) {
    const uint32_t next = (k + 1) % count;
    mesh.triangles.push_back({k, next, next + count});
    mesh.triangles.push_back({k, next + count, k + count});
  }
  for (const auto& [a, b, c] : std::vector<Triangle>{{0, 1, 7},
                                                     {0, 7, 8},
                                                     {0, 8, 9},
                                                     {1, 2, 6},
                                                     {1, 6, 7},
                                                     {3, 4, 5},
                                                     {3, 5, 6},
                                                     {3, 6, 2}}) {
    mesh.triangles.push_back({a, c, b});
    mesh.triangles.push_back({a + count, b + count, c + count});
  }
  return mesh;
}

// By volume alone a notch might be filled; by surface it may not, however thin the beam is.
TEST(Decomposition, NotchesStayOpen) {
  struct Notch {
    double thickness, from, to, depth;
  };
  for (const Notch& n : {Notch{0.04, 0.179, 0.221, 0.06},
                         {0.04, 0.05, 0.075, 0.03},
                         {0.01, 0.3, 0.325, 0.04},
                         {0.2, 0.18, 0.205, 0.1}}) {
    const TriangleMesh mesh = notched_beam(n.thickness, n.from, n.to, n.depth);
    ASSERT_THAT(find_mesh_defects(mesh), IsEmpty());
    const Decomposition result = decompose(mesh, {}, std::nullopt);
    EXPECT_LE(result.pieces.size(), 6u);
    EXPECT_LE(result.surface_share, 0.01);
    EXPECT_EQ(result.hollow_share, 0);
    EXPECT_NEAR(result.surface_share, result.surface_error_m / 0.4, 1e-12);
    // The pieces stay out of the notch, except for 0.5 mm at its walls.
    const double inset = 5e-4;
    for (const TriangleMesh& piece : result.pieces) {
      for (const double x : {n.from + inset, (n.from + n.to) / 2, n.to - inset}) {
        for (const double y : {0.12 - n.depth + inset, 0.12 - n.depth / 2}) {
          const Vec3 point(x, y, n.thickness / 2);
          double above = -1;
          for (const auto& [a, b, c] : piece.triangles) {
            const Vec3& corner = piece.vertices[a];
            const Vec3 normal =
                (piece.vertices[b] - corner).cross(piece.vertices[c] - corner).stableNormalized();
            above = std::max(above, normal.dot(point - corner));
          }
          EXPECT_GT(above, 0) << "a piece fills " << point.transpose();
        }
      }
    }
  }
}

TEST(Decomposition, TubesAreCutAlong) {
  constexpr int kSides = 48;
  constexpr double kInner = 0.85;
  TriangleMesh tube;
  for (const double y : {0.0, 2.0}) {
    for (const double radius : {1.0, kInner}) {
      for (int k = 0; k < kSides; ++k) {
        const double angle = 2 * M_PI * k / kSides;
        tube.vertices.emplace_back(radius * std::cos(angle), y, radius * std::sin(angle));
      }
    }
  }
  const auto quad = [&](uint32_t a, uint32_t b, uint32_t c, uint32_t d) {
    tube.triangles.push_back({a, b, c});
    tube.triangles.push_back({a, c, d});
  };
  for (uint32_t k = 0; k < kSides; ++k) {
    const uint32_t next = (k + 1) % kSides, n = kSides;
    quad(k, 2 * n + k, 2 * n + next, next);                  // outside
    quad(n + k, n + next, 3 * n + next, 3 * n + k);          // inside
    quad(k, next, n + next, n + k);                          // below
    quad(2 * n + k, 3 * n + k, 3 * n + next, 2 * n + next);  // above
  }
  constexpr int kPieces = 12;
  const Decomposition result = decompose(tube, {.max_pieces = kPieces}, std::nullopt);
  // For equal sectors, each with the flat inside that minimises the error: a quarter of the arc's
  // height.
  const double height = kInner * (1 - std::cos(M_PI / kPieces));
  EXPECT_LT(result.volume_error(), 1.1 * height / 4 / (1 - kInner));
}

TEST(Decomposition, MorePiecesFollowTheMeshMoreClosely) {
  const TriangleMesh blob = blob_mesh(2);
  double last_error = 1;
  for (const int pieces : {1, 3, 9}) {
    const DecompositionOptions options{.max_pieces = pieces, .max_volume_error = 1e-4};
    const Decomposition result = decompose(blob, options, std::nullopt);
    EXPECT_THAT(result.pieces, SizeIs(pieces));
    EXPECT_THAT(result.volume_error(), Lt(last_error));
    last_error = result.volume_error();
    expect_convex_pieces(result, options.max_piece_vertices);
  }
  EXPECT_LT(last_error, 0.06);
}

TEST(Decomposition, StopsWhereTheErrorIsSmallEnough) {
  const TriangleMesh blob = blob_mesh(2);
  const Decomposition coarse = decompose(blob, {.max_volume_error = 0.1}, std::nullopt);
  const Decomposition fine = decompose(blob, {.max_volume_error = 0.05}, std::nullopt);
  EXPECT_LE(coarse.volume_error(), 0.1);
  EXPECT_LE(fine.volume_error(), 0.05);
  EXPECT_LT(coarse.pieces.size(), fine.pieces.size());
  EXPECT_LE(fine.pieces.size(), 24u);
}

TEST(Decomposition, PiecesHaveFewVertices) {
  const DecompositionOptions options{.max_volume_error = 0.1, .max_piece_vertices = 12};
  const Decomposition result = decompose(blob_mesh(2), options, std::nullopt);
  expect_convex_pieces(result, 12);
}

TEST(Decomposition, ScaleMakesNoDifference) {
  const TriangleMesh blob = blob_mesh(2);
  const DecompositionOptions options{.max_pieces = 6, .max_volume_error = 0.01};
  const Decomposition reference = decompose(blob, options, std::nullopt);
  // Powers of two scale the mesh exactly.
  for (const double factor : {1024.0, 1.0 / 1024}) {
    const Decomposition result = decompose(scaled(blob, factor), options, std::nullopt);
    ASSERT_EQ(result.pieces.size(), reference.pieces.size());
    for (size_t k = 0; k < result.pieces.size(); ++k) {
      const std::vector<Vec3>& vertices = result.pieces[k].vertices;
      ASSERT_EQ(vertices.size(), reference.pieces[k].vertices.size());
      for (size_t v = 0; v < vertices.size(); ++v) {
        EXPECT_LT((vertices[v] / factor - reference.pieces[k].vertices[v]).norm(), 1e-9);
      }
    }
    EXPECT_NEAR(result.volume_error(), reference.volume_error(), 1e-9);
    EXPECT_NEAR(result.surface_error_m / factor, reference.surface_error_m, 1e-9);
  }
}

// A bar along x with `groups` named groups: two boxes, the second shifted by `shift`.
TriangleMesh two_boxes(double shift) {
  const TriangleMesh box = box_mesh({1, 1, 1});
  TriangleMesh mesh = test::joined(box, test::moved(box, {.position = {shift, 0.1 * shift, 0}}));
  mesh.groups = {{"left", 0, 12}, {"right", 12, 12}};
  return mesh;
}

// The hull of part of it is nearly all roof over its hollow.
TEST(Decomposition, ThinShellsHavePiecesHoweverFew) {
  constexpr int kSide = 12;
  TriangleMesh shell;
  for (const double below : {0.0, 0.01}) {
    for (int i = 0; i <= kSide; ++i) {
      for (int k = 0; k <= kSide; ++k) {
        const double x = 2.0 * i / kSide - 1, z = 2.0 * k / kSide - 1;
        shell.vertices.emplace_back(x, 0.4 * std::sin(3 * x) * std::cos(4 * z) - below, z);
      }
    }
  }
  const auto at = [](int side, int i, int k) {
    return static_cast<uint32_t>((side * (kSide + 1) + i) * (kSide + 1) + k);
  };
  const auto quad = [&](uint32_t a, uint32_t b, uint32_t c, uint32_t d) {
    shell.triangles.push_back({a, b, c});
    shell.triangles.push_back({a, c, d});
  };
  for (int i = 0; i < kSide; ++i) {
    for (int k = 0; k < kSide; ++k) {
      quad(at(0, i, k), at(0, i, k + 1), at(0, i + 1, k + 1), at(0, i + 1, k));
      quad(at(1, i, k), at(1, i + 1, k), at(1, i + 1, k + 1), at(1, i, k + 1));
    }
    quad(at(0, i, 0), at(0, i + 1, 0), at(1, i + 1, 0), at(1, i, 0));
    quad(at(0, i, kSide), at(1, i, kSide), at(1, i + 1, kSide), at(0, i + 1, kSide));
    quad(at(0, 0, i), at(1, 0, i), at(1, 0, i + 1), at(0, 0, i + 1));
    quad(at(0, kSide, i), at(0, kSide, i + 1), at(1, kSide, i + 1), at(1, kSide, i));
  }
  for (const int pieces : {2, 4, 8}) {
    const Decomposition result = decompose(shell, {.max_pieces = pieces}, std::nullopt);
    EXPECT_FALSE(result.pieces.empty());
    EXPECT_LE(result.pieces.size(), static_cast<size_t>(pieces));
  }
}

TEST(Decomposition, ConvexGroupsAreTakenAsTheyAre) {
  const TriangleMesh mesh = two_boxes(0.5);
  const Decomposition result = decompose(mesh, {}, std::nullopt);
  EXPECT_TRUE(result.from_groups);
  ASSERT_THAT(result.pieces, SizeIs(2));
  EXPECT_EQ(result.pieces[0].vertices.size(), 8u);
  EXPECT_EQ(result.pieces[1].vertices[0], mesh.vertices[mesh.triangles[12][0]]);
  EXPECT_DOUBLE_EQ(result.mesh_volume_m3, 2.0);
  const double overlap = 0.5 * 0.95;
  EXPECT_NEAR(result.union_volume_m3, 2.0 - overlap, 1e-3);
  EXPECT_NEAR(result.missing_volume_m3, overlap, 1e-3);
  EXPECT_NEAR(result.excess_volume_m3, 0, 1e-12);
  EXPECT_EQ(result.surface_error_m, 0);
}

TEST(Decomposition, GroupsThatAreNotConvexPiecesAreIgnored) {
  TriangleMesh mesh = l_shape_mesh();
  mesh.groups = {{"front", 0, 4}, {"back", 4, 16}};
  const Decomposition result = decompose(mesh, {}, std::nullopt);
  EXPECT_FALSE(result.from_groups);
  EXPECT_THAT(result.pieces, SizeIs(2));
}

TEST(Decomposition, OpenMeshIsRefused) {
  TriangleMesh mesh = l_shape_mesh();
  mesh.triangles.pop_back();
  try {
    decompose(mesh, {}, std::nullopt);
    FAIL() << "an open mesh was taken";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::input);
    EXPECT_THAT(error.what(), HasSubstr("edge"));
    EXPECT_THAT(error.what(), HasSubstr("convex hull"));
  }
}

// The error offered for more pieces is close to their actual error.
TEST(Decomposition, OffersMorePiecesWhereItMissesWhatWasAskedFor) {
  const TriangleMesh torus = test::torus_mesh(1, 0.3, 32, 12);
  const Decomposition few = decompose(torus, {.max_pieces = 4, .max_volume_error = 0.05}, {});
  EXPECT_GT(few.volume_error(), 0.05);
  ASSERT_GT(few.more_pieces, 4);
  EXPECT_LT(few.error_with_more, few.volume_error());
  const Decomposition more =
      decompose(torus, {.max_pieces = few.more_pieces, .max_volume_error = 0.05}, {});
  EXPECT_NEAR(more.volume_error() / few.error_with_more, 1, 0.5);
  EXPECT_LT(more.volume_error(), few.volume_error());
  // If the error is small enough there is nothing to offer.
  const Decomposition held = decompose(torus, {.max_pieces = 32, .max_volume_error = 0.2}, {});
  EXPECT_LE(held.volume_error(), 0.2);
  EXPECT_EQ(held.more_pieces, 0);
}

class DecompositionCacheTest : public testing::Test {
 protected:
  void SetUp() override {
    directory_ = std::filesystem::temp_directory_path() /
                 ("pilesim_cache_test_" +
                  std::string(testing::UnitTest::GetInstance()->current_test_info()->name()));
    std::filesystem::remove_all(directory_);
  }
  void TearDown() override { std::filesystem::remove_all(directory_); }

  std::vector<std::filesystem::path> files() const {
    std::vector<std::filesystem::path> result;
    for (const auto& entry : std::filesystem::directory_iterator(directory_)) {
      result.push_back(entry.path());
    }
    return result;
  }
  Decomposition run() const { return decompose(mesh_, options_, directory_ / "deep"); }
  std::filesystem::path only_file() const {
    return std::filesystem::directory_iterator(directory_ / "deep")->path();
  }

  std::filesystem::path directory_;
  TriangleMesh mesh_ = l_shape_mesh();
  DecompositionOptions options_;
};

void expect_same(const Decomposition& a, const Decomposition& b) {
  ASSERT_EQ(a.pieces.size(), b.pieces.size());
  for (size_t k = 0; k < a.pieces.size(); ++k) {
    EXPECT_EQ(a.pieces[k].vertices, b.pieces[k].vertices);
    EXPECT_EQ(a.pieces[k].triangles, b.pieces[k].triangles);
  }
  EXPECT_EQ(a.mesh_volume_m3, b.mesh_volume_m3);
  EXPECT_EQ(a.union_volume_m3, b.union_volume_m3);
  EXPECT_EQ(a.excess_volume_m3, b.excess_volume_m3);
  EXPECT_EQ(a.missing_volume_m3, b.missing_volume_m3);
  EXPECT_EQ(a.surface_error_m, b.surface_error_m);
  EXPECT_EQ(a.mean_surface_error_m, b.mean_surface_error_m);
  EXPECT_EQ(a.from_groups, b.from_groups);
  EXPECT_EQ(a.more_pieces, b.more_pieces);
  EXPECT_EQ(a.error_with_more, b.error_with_more);
}

TEST_F(DecompositionCacheTest, GivesBackWhatWasComputed) {
  const Decomposition computed = run();
  EXPECT_FALSE(computed.from_cache);
  const Decomposition cached = run();
  EXPECT_TRUE(cached.from_cache);
  expect_same(computed, cached);
}

TEST_F(DecompositionCacheTest, OtherMeshGroupsOrOptionsAreOtherEntries) {
  run();
  options_.max_pieces = 5;
  EXPECT_FALSE(run().from_cache);
  mesh_.groups = {{"all", 0, 20}};
  EXPECT_FALSE(run().from_cache);
  mesh_.vertices[0].x() += 0.01;
  mesh_.vertices[6].x() += 0.01;
  EXPECT_FALSE(run().from_cache);
  directory_ /= "deep";
  EXPECT_THAT(files(), SizeIs(4));
}

TEST_F(DecompositionCacheTest, DamagedFilesAreReplaced) {
  const Decomposition computed = run();
  const std::string whole = read_file(only_file());
  std::string flipped = whole;
  flipped[whole.size() / 2] ^= 0x10;
  for (const std::string& damaged : {flipped, whole.substr(0, whole.size() / 2), std::string(),
                                     whole.substr(0, 32), std::string("no cache at all")}) {
    write_file_atomically(only_file(), damaged);
    const Decomposition again = run();
    EXPECT_FALSE(again.from_cache);
    expect_same(computed, again);
    EXPECT_EQ(read_file(only_file()), whole);
  }
}

// The system kills it at the byte that exceeds the limit on file sizes.
TEST_F(DecompositionCacheTest, ProcessThatDiesWhileItWritesLeavesNothingByHalf) {
  const Decomposition computed = run();
  const std::string whole = read_file(only_file());
  const DecompositionCache cache(directory_ / "deep", mesh_, options_);
  std::filesystem::remove(cache.file());
  const pid_t child = fork();
  if (child == 0) {
    const rlimit half{whole.size() / 2, whole.size() / 2}, none{0, 0};
    setrlimit(RLIMIT_FSIZE, &half);
    setrlimit(RLIMIT_CORE, &none);
    std::signal(SIGXFSZ, SIG_DFL);
    cache.store(computed);
    _exit(0);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == SIGXFSZ);
  EXPECT_EQ(std::filesystem::file_size(only_file()), whole.size() / 2);
  EXPECT_FALSE(std::filesystem::exists(cache.file()));
  EXPECT_FALSE(run().from_cache);
  EXPECT_EQ(read_file(cache.file()), whole);
}

TEST_F(DecompositionCacheTest, DirectoryThatCannotBeMadeIsAnError) {
  write_file_atomically(directory_, "a file");
  EXPECT_THROW(run(), Error);
}

}  // namespace
}  // namespace pilesim
