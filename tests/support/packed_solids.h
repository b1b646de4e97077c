// Bodies of beds with experimentally known packings, and their cups. Polygons that replace circles
// have the circle's area.
#pragma once

#include <array>
#include <cmath>
#include <vector>

#include "core/error.h"
#include "geometry/convex_hull.h"
#include "geometry/mass_properties.h"
#include "geometry/mesh.h"

namespace pilesim {

// The regular polyhedron with 4, 6, 8, 12 or 20 faces and volume 1, about the origin.
inline TriangleMesh platonic_solid(int faces) {
  const double golden = (1 + std::sqrt(5.0)) / 2;
  std::vector<Vec3> corners;
  // All signs of a point, and its three cyclic permutations.
  const auto add = [&](double x, double y, double z) {
    for (int signs = 0; signs < 8; ++signs) {
      const Vec3 p(signs & 1 ? -x : x, signs & 2 ? -y : y, signs & 4 ? -z : z);
      for (int turn = 0; turn < 3; ++turn) {
        corners.emplace_back(p[turn], p[(turn + 1) % 3], p[(turn + 2) % 3]);
      }
    }
  };
  switch (faces) {
    case 4:
      corners = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
      break;
    case 6:
      add(1, 1, 1);
      break;
    case 8:
      add(1, 0, 0);
      break;
    case 12:
      add(1, 1, 1);
      add(0, 1 / golden, golden);
      break;
    case 20:
      add(0, 1, golden);
      break;
    default:
      throw Error(ErrorKind::usage, Problem{.found = "no regular polyhedron of so many faces"});
  }
  TriangleMesh mesh = convex_hull(corners);
  const double scale = 1 / std::cbrt(mass_properties(mesh).volume_m3);
  for (Vec3& vertex : mesh.vertices) vertex *= scale;
  return mesh;
}

// The radius of the corners of a regular polygon that has the area of a circle.
inline double corner_radius(double circle_radius, int sides) {
  return circle_radius * std::sqrt(2 * kPi / (sides * std::sin(2 * kPi / sides)));
}

// A solid of revolution about y with flat sides. `profile` is a closed polygon of (radius, y),
// counter-clockwise with the radius to the right and y upwards. Points on the axis (radius 0)
// become one vertex.
inline TriangleMesh turned_solid(const std::vector<std::array<double, 2>>& profile, int sides) {
  TriangleMesh mesh;
  std::vector<uint32_t> first;  // first vertex of each point of the profile
  for (const auto& [radius, y] : profile) {
    first.push_back(static_cast<uint32_t>(mesh.vertices.size()));
    const double corner = corner_radius(radius, sides);
    for (int side = 0; side < (radius > 0 ? sides : 1); ++side) {
      const double angle = 2 * kPi * side / sides;
      mesh.vertices.emplace_back(corner * std::cos(angle), y, -corner * std::sin(angle));
    }
  }
  const auto vertex = [&](size_t point, int side) {
    return first[point] + static_cast<uint32_t>(profile[point][0] > 0 ? side % sides : 0);
  };
  for (size_t point = 0; point < profile.size(); ++point) {
    const size_t next = (point + 1) % profile.size();
    for (int side = 0; side < sides; ++side) {
      const uint32_t a = vertex(point, side), b = vertex(point, side + 1);
      const uint32_t c = vertex(next, side + 1), d = vertex(next, side);
      if (a != b) mesh.triangles.push_back({a, b, c});
      if (c != d) mesh.triangles.push_back({a, c, d});
    }
  }
  return mesh;
}

// Full height; `inner_radius` 0 gives a solid cylinder.
inline TriangleMesh ring_mesh(double radius, double inner_radius, double height, int sides) {
  const double h = height / 2;
  if (inner_radius > 0) {
    return turned_solid({{inner_radius, -h}, {radius, -h}, {radius, h}, {inner_radius, h}}, sides);
  }
  return turned_solid({{0, -h}, {radius, -h}, {radius, h}, {0, h}}, sides);
}

// A cup with its floor at y = 0, open at the top.
inline TriangleMesh cup_mesh(double inner_radius, double height, double wall, int sides) {
  return turned_solid({{0, -wall},
                       {inner_radius + wall, -wall},
                       {inner_radius + wall, height},
                       {inner_radius, height},
                       {inner_radius, 0},
                       {0, 0}},
                      sides);
}

}  // namespace pilesim
