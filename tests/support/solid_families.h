// Solids of many proportions, none of which was used for tuning. The bounding radius about the
// origin is 1.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "geometry/convex_hull.h"
#include "geometry/primitives.h"
#include "support/packed_solids.h"

namespace pilesim {

struct NamedSolid {
  std::string name;
  TriangleMesh mesh;
};

// A polygon, counter-clockwise and star-shaped about the origin, with thickness `height`.
inline TriangleMesh prism_of(const std::vector<std::array<double, 2>>& polygon, double height) {
  TriangleMesh mesh;
  const auto count = static_cast<uint32_t>(polygon.size());
  for (const double y : {-height / 2, height / 2}) {
    for (const auto& [x, z] : polygon) mesh.vertices.emplace_back(x, y, -z);
  }
  mesh.vertices.emplace_back(0, -height / 2, 0);
  mesh.vertices.emplace_back(0, height / 2, 0);
  for (uint32_t i = 0; i < count; ++i) {
    const uint32_t next = (i + 1) % count;
    mesh.triangles.push_back({i, next, count + next});
    mesh.triangles.push_back({i, count + next, count + i});
    mesh.triangles.push_back({2 * count, next, i});
    mesh.triangles.push_back({2 * count + 1, count + i, count + next});
  }
  return mesh;
}

// With `points` corners at radius 1 and as many at `inner`.
inline TriangleMesh star_mesh(int points, double inner, double height) {
  std::vector<std::array<double, 2>> polygon;
  for (int i = 0; i < 2 * points; ++i) {
    const double radius = i % 2 == 0 ? 1 : inner, angle = kPi * i / points;
    polygon.push_back({radius * std::cos(angle), radius * std::sin(angle)});
  }
  return prism_of(polygon, height);
}

// A circle of `tube` about the axis at radius 1.
inline TriangleMesh torus_solid(double tube, int sides) {
  std::vector<std::array<double, 2>> profile;
  for (int i = 0; i < 10; ++i) {
    const double angle = 2 * kPi * i / 10;
    profile.push_back({1 + tube * std::cos(angle), tube * std::sin(angle)});
  }
  return turned_solid(profile, sides);
}

// Half of a hollow ball, open at the top.
inline TriangleMesh bowl_mesh(double wall, int sides) {
  std::vector<std::array<double, 2>> profile;
  constexpr int kSteps = 6;
  for (int i = 0; i <= kSteps; ++i) {
    const double angle = kPi / 2 * i / kSteps;
    profile.push_back({i == 0 ? 0 : std::sin(angle), -std::cos(angle)});
  }
  for (int i = kSteps; i >= 0; --i) {
    const double angle = kPi / 2 * i / kSteps;
    profile.push_back({i == 0 ? 0 : (1 - wall) * std::sin(angle), -(1 - wall) * std::cos(angle)});
  }
  return turned_solid(profile, sides);
}

// About its centre of mass, with bounding radius 1.
inline TriangleMesh of_radius_1(TriangleMesh mesh) {
  const Vec3 centre = mass_properties(mesh).centre_of_mass;
  double radius = 0;
  for (Vec3& vertex : mesh.vertices) radius = std::max(radius, (vertex -= centre).norm());
  for (Vec3& vertex : mesh.vertices) vertex /= radius;
  return mesh;
}

inline std::vector<NamedSolid> solid_families() {
  std::vector<NamedSolid> solids = {
      {"plate", box_mesh({1, 0.15, 1})},
      {"long_plate", box_mesh({3, 0.3, 1})},
      {"coin", ring_mesh(1, 0, 0.24, 24)},
      {"round_rod", ring_mesh(0.2, 0, 2, 16)},
      {"square_rod", box_mesh({1, 1, 5})},
      {"tetrahedron", platonic_solid(4)},
      {"octahedron", platonic_solid(8)},
      {"wedge", prism_of({{1, 0}, {-0.5, 0.87}, {-0.5, -0.87}}, 1)},
      {"cone", turned_solid({{0, 0}, {0.7, 0}, {0, 1.6}}, 20)},
      {"thick_star", star_mesh(5, 0.4, 0.6)},
      {"thin_star", star_mesh(6, 0.5, 0.2)},
      {"thick_torus", torus_solid(0.45, 20)},
      {"thin_torus", torus_solid(0.2, 24)},
      {"tube", ring_mesh(0.6, 0.45, 1.6, 18)},
      {"short_tube", ring_mesh(1, 0.8, 0.5, 20)},
      {"bowl", bowl_mesh(0.15, 20)},
      {"cup",
       turned_solid({{0, 0}, {0.6, 0}, {0.8, 1.6}, {0.68, 1.6}, {0.5, 0.15}, {0, 0.15}}, 18)},
      {"dented_ball",
       turned_solid(
           {{0, -1}, {0.5, -0.87}, {0.87, -0.5}, {1, 0}, {0.87, 0.5}, {0.5, 0.8}, {0, 0.3}}, 18)},
      {"dumbbell", turned_solid({{0, -1},
                                 {0.4, -0.9},
                                 {0.5, -0.6},
                                 {0.15, -0.3},
                                 {0.15, 0.3},
                                 {0.5, 0.6},
                                 {0.4, 0.9},
                                 {0, 1}},
                                16)},
      {"hourglass", turned_solid({{0, -1}, {0.8, -1}, {0.2, 0}, {0.8, 1}, {0, 1}}, 16)},
      {"jack", star_mesh(4, 0.25, 0.35)},
      {"slab", box_mesh({1, 0.4, 0.8})},
      {"lens", turned_solid({{0, -0.3}, {0.6, -0.2}, {1, 0}, {0.6, 0.2}, {0, 0.3}}, 20)},
      {"spindle", turned_solid({{0, -1}, {0.25, -0.5}, {0.35, 0}, {0.25, 0.5}, {0, 1}}, 16)},
  };
  for (NamedSolid& solid : solids) solid.mesh = of_radius_1(std::move(solid.mesh));
  return solids;
}

}  // namespace pilesim
