#include "signature/rest/rest_poses.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>

#include "../geometry_shapes.h"
#include "geometry/convex_hull.h"
#include "geometry/mass_properties.h"
#include "geometry/mesh_import.h"
#include "geometry/primitives.h"
#include "support/random_vectors.h"

namespace pilesim {
namespace {

TriangleMesh prism(uint32_t sides, double height) {
  std::vector<Vec3> points;
  for (uint32_t i = 0; i < sides; ++i) {
    const double angle = 2 * kPi * i / sides;
    for (const double z : {0.0, height}) points.emplace_back(std::cos(angle), std::sin(angle), z);
  }
  return convex_hull(points);
}

TriangleMesh octahedron(double cut) {
  std::vector<Vec3> points;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {-1.0, 1.0}) {
      Vec3 tip = Vec3::Zero();
      tip(axis) = sign;
      if (cut == 0) points.push_back(tip);
      for (int side = 0; cut > 0 && side < 4; ++side) {
        Vec3 corner = (1 - cut) * tip;
        corner((axis + 1 + side / 2) % 3) = side % 2 == 0 ? cut : -cut;
        points.push_back(corner);
      }
    }
  }
  return convex_hull(points);
}

TriangleMesh dodecahedron() {
  const double golden = (1 + std::sqrt(5.0)) / 2;
  std::vector<Vec3> points;
  for (int i = 0; i < 8; ++i) points.emplace_back(2 * (i & 1) - 1, (i & 2) - 1, (i & 4) / 2 - 1);
  for (int i = 0; i < 12; ++i) {
    Vec3 point = Vec3::Zero();
    point((i + 1) % 3) = (i % 4 < 2 ? 1 : -1) / golden;
    point((i + 2) % 3) = (i % 2 == 0 ? 1 : -1) * golden;
    points.push_back(point);
  }
  return convex_hull(points);
}

TriangleMesh random_hull(Philox& random, uint32_t count) {
  std::vector<Vec3> points;
  for (uint32_t i = 0; i < count; ++i) points.push_back(test::random_arrow(random, 0.6, 1));
  return convex_hull(points);
}

// The hull of an L-bracket: not a body of revolution, with large and narrow faces.
TriangleMesh bracket() {
  return convex_hull(std::vector<Vec3>{{0, 0, 0},
                                       {3, 0, 0},
                                       {3, 0, 0.4},
                                       {0.4, 0, 2},
                                       {0, 0, 2},
                                       {0, 1, 0},
                                       {3, 1, 0},
                                       {3, 1, 0.4},
                                       {0.4, 1, 2},
                                       {0, 1, 2}});
}

TriangleMesh polyhedron(uint64_t which, Philox& random) {
  switch (which % 9) {
    case 0:
      return box_mesh({1, 1, 1});
    case 1:
      return box_mesh({0.3, 1, 1.7});
    case 2: {
      const uint32_t sides = 3 + random.index(9);
      return prism(sides, random.uniform(0.2, 3));
    }
    case 3:
      return octahedron(0);
    case 4:
      return octahedron(1.0 / 3);
    case 5:
      return dodecahedron();
    case 6:
      return bracket();
    case 7:
      return convex_hull(std::vector<Vec3>{{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}});
    default:
      return random_hull(random, 5 + random.index(10));
  }
}

// Divides each triangle of `plain` into parts * parts.
TriangleMesh subdivided(const TriangleMesh& plain, uint32_t parts) {
  TriangleMesh mesh;
  for (const auto& [a, b, c] : plain.triangles) {
    std::vector<std::vector<uint32_t>> rows;
    for (uint32_t i = 0; i <= parts; ++i) {
      rows.emplace_back();
      for (uint32_t j = 0; i + j <= parts; ++j) {
        rows.back().push_back(static_cast<uint32_t>(mesh.vertices.size()));
        const double u = static_cast<double>(i) / parts, v = static_cast<double>(j) / parts;
        mesh.vertices.push_back((1 - u - v) * plain.vertices[a] + u * plain.vertices[b] +
                                v * plain.vertices[c]);
      }
    }
    for (uint32_t i = 0; i < parts; ++i) {
      for (uint32_t j = 0; i + j < parts; ++j) {
        mesh.triangles.push_back({rows[i][j], rows[i + 1][j], rows[i][j + 1]});
        if (i + j + 1 == parts) continue;
        mesh.triangles.push_back({rows[i + 1][j], rows[i + 1][j + 1], rows[i][j + 1]});
      }
    }
  }
  return mesh;
}

// Through an OBJ file with this many digits.
TriangleMesh rounded(const TriangleMesh& mesh, int digits) {
  const auto file = std::filesystem::temp_directory_path() /
                    ("pilesim_rest_poses_" + std::to_string(getpid()) + ".obj");
  std::string text;
  for (const Vec3& v : mesh.vertices) {
    char line[128];
    std::snprintf(line, sizeof line, "v %.*g %.*g %.*g\n", digits, v.x(), digits, v.y(), digits,
                  v.z());
    text += line;
  }
  for (const auto& [a, b, c] : mesh.triangles) {
    text += "f " + std::to_string(a + 1) + ' ' + std::to_string(b + 1) + ' ' +
            std::to_string(c + 1) + '\n';
  }
  std::ofstream(file) << text;
  TriangleMesh read = import_mesh(file);
  std::filesystem::remove(file);
  return read;
}

std::vector<RestPose> poses_of_solid(const TriangleMesh& mesh) {
  return mesh_rest_poses(mesh, mass_properties(mesh).centre_of_mass);
}

// Rounding of 1e-5 of the size may rotate faces and shift basins by a few times that.
TEST(RestPosesProperty, SubdividedTurnedAndRoundedPolyhedraHaveThePosesOfThePlainOnes) {
  for (uint64_t trial = 0; trial < 135; ++trial) {
    Philox random(17, Stream::test, trial);
    const TriangleMesh plain = polyhedron(trial, random);
    const auto digits = static_cast<int>(5 + trial / 9 % 3);
    const double size = std::pow(10, random.uniform(-3, 3));
    Pose pose{.orientation = random.rotation()};
    // Far from the origin the position takes most digits.
    const bool far_away = digits == 7 && trial % 2 == 1;
    if (far_away) pose.position = 1000 * size * random.direction();
    TriangleMesh turned = subdivided(plain, 2 + random.index(6));
    for (Vec3& v : turned.vertices) v *= size;
    const TriangleMesh read = rounded(test::moved(turned, pose), digits);
    SCOPED_TRACE(testing::Message() << "trial " << trial << ", digits " << digits << ", size "
                                    << size << (far_away ? ", far away" : ""));

    const std::vector<RestPose> expected = poses_of_solid(plain), found = poses_of_solid(read);
    const double tolerance = std::max(1e-5, 20 * read.rounding_m / size);
    ASSERT_EQ(found.size(), expected.size());
    for (const RestPose& e : expected) {
      const Vec3 up = pose.orientation * e.up;
      const auto f =
          std::ranges::max_element(found, {}, [&](const RestPose& one) { return one.up.dot(up); });
      EXPECT_LE((f->up - up).norm(), tolerance);
      EXPECT_NEAR(f->probability, e.probability, tolerance);
      EXPECT_NEAR(f->height_m, size * e.height_m, size * tolerance);
    }
  }
}

// However finely divided, a side is round and not a face: a ring of narrow faces remains.
TEST(RestPosesProperty, RoundSidesAreNotBentIntoOneFace) {
  for (const uint32_t sides : {96u, 960u, 4800u}) {
    const auto poses = stable_rest_poses(cylinder_mesh(0.5, 1, sides));
    EXPECT_GE(poses.size(), 2 + std::min(sides, 400u)) << sides;
    double side = 0, least = 1;
    for (const RestPose& pose : poses) {
      if (std::abs(pose.up.y()) > 0.5) continue;
      side += pose.probability;
      least = std::min(least, pose.height_m);
    }
    EXPECT_NEAR(side, 0.7071, 2e-3)
        << sides;  // seen from the centre, the ends' cones cover the rest
    EXPECT_GE(least, 0.4997) << sides;
  }
}

// Rolls by small rotations about the lowest vertex, towards the side where the centre of mass
// falls, until it falls no more. The final up direction gives the pose.
Vec3 roll(const TriangleMesh& hull, Vec3 down) {
  constexpr double kTurn = 1e-3;
  double lowest = std::numeric_limits<double>::infinity();
  for (int without_fall = 0; without_fall < 400;) {
    const Vec3* touching = &hull.vertices.front();
    for (const Vec3& v : hull.vertices) {
      if (v.dot(down) > touching->dot(down)) touching = &v;
    }
    const double height = touching->dot(down);
    without_fall = height < lowest ? 0 : without_fall + 1;
    lowest = std::min(lowest, height);
    const Vec3 sideways = *touching - height * down;
    down = (down - kTurn * sideways.stableNormalized()).normalized();
  }
  return -down;
}

TEST(RestPosesProperty, ProbabilitiesAreThoseOfRollingInSmallSteps) {
  constexpr int kRolls = 500;
  for (uint64_t trial = 0; trial < 6; ++trial) {
    Philox random(23, Stream::test, trial);
    TriangleMesh hull = random_hull(random, 6 + 2 * static_cast<uint32_t>(trial));
    const Vec3 centre = mass_properties(hull).centre_of_mass;
    for (Vec3& v : hull.vertices) v -= centre;
    const auto poses = stable_rest_poses(hull);
    std::vector<double> count(poses.size(), 0);
    for (int i = 0; i < kRolls; ++i) {
      const Vec3 up = roll(hull, random.direction());
      const auto pose =
          std::ranges::max_element(poses, {}, [&](const RestPose& p) { return p.up.dot(up); });
      ++count[static_cast<size_t>(pose - poses.begin())];
    }
    for (size_t p = 0; p < poses.size(); ++p) {
      const double share = poses[p].probability;
      const double sigma = std::sqrt(share * (1 - share) / kRolls);
      // The rotations add about their length along a border.
      EXPECT_NEAR(count[p] / kRolls, share, 3.5 * sigma + 2e-3)
          << "trial " << trial << " pose " << p;
    }
  }
}

// Bodies with points on and near flat faces, with any spread of sizes and digits.
TEST(RestPosesProperty, DirtyHullsHavePosesThatShareTheSphere) {
  int hulls = 0;
  for (uint64_t trial = 0; trial < 240; ++trial) {
    Philox random(29, Stream::test, trial);
    const double noise = std::pow(10, random.uniform(-16, -2));
    const Vec3 scale{std::pow(10, random.uniform(-2, 0)), 1, std::pow(10, random.uniform(-1, 0))};
    const Quat turn = random.rotation();
    std::vector<Vec3> points;
    for (uint32_t i = 0; i < 8 + random.index(150); ++i) {
      Vec3 point = test::random_in_box(random, -1, 1);
      if (trial % 3 != 0) point(i % 3) = std::round(point(i % 3));
      if (trial % 5 == 0) point = (3 * point).array().round() / 3;
      point += noise * random.direction();
      points.push_back(turn * point.cwiseProduct(scale));
    }
    TriangleMesh hull = convex_hull(points);
    const Vec3 centre = mass_properties(hull).centre_of_mass;
    for (Vec3& v : hull.vertices) v -= centre;
    double sum = 0;
    for (const RestPose& pose : stable_rest_poses(hull)) sum += pose.probability;
    EXPECT_NEAR(sum, 1, 1e-6) << trial;
    ++hulls;
  }
  EXPECT_EQ(hulls, 240);
}

}  // namespace
}  // namespace pilesim
