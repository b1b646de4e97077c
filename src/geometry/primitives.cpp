#include "geometry/primitives.h"

#include <cassert>
#include <cmath>
#include <map>
#include <utility>

namespace pilesim {

TriangleMesh box_mesh(const Vec3& size) {
  TriangleMesh mesh;
  // Bit 0 of a vertex index says which side in x, bit 1 in y, bit 2 in z.
  for (uint32_t corner = 0; corner < 8; ++corner) {
    const Vec3 sign(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
    mesh.vertices.push_back(0.5 * sign.cwiseProduct(size));
  }
  mesh.triangles = {{0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}};
  return mesh;
}

namespace {

TriangleMesh unit_icosahedron() {
  const double golden = (1.0 + std::sqrt(5.0)) / 2.0;
  TriangleMesh mesh;
  mesh.vertices = {{-1, golden, 0}, {1, golden, 0}, {-1, -golden, 0}, {1, -golden, 0},
                   {0, -1, golden}, {0, 1, golden}, {0, -1, -golden}, {0, 1, -golden},
                   {golden, 0, -1}, {golden, 0, 1}, {-golden, 0, -1}, {-golden, 0, 1}};
  for (Vec3& vertex : mesh.vertices) vertex.normalize();
  mesh.triangles = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                    {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                    {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                    {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
  return mesh;
}

// Each triangle becomes four, the new vertices on the unit sphere.
TriangleMesh subdivided_on_sphere(const TriangleMesh& coarse) {
  TriangleMesh fine;
  fine.vertices = coarse.vertices;
  fine.triangles.reserve(4 * coarse.triangles.size());
  std::map<std::pair<uint32_t, uint32_t>, uint32_t> middle_of_edge;
  const auto middle = [&](uint32_t a, uint32_t b) {
    const auto [place, is_new] =
        middle_of_edge.try_emplace(std::minmax(a, b), static_cast<uint32_t>(fine.vertices.size()));
    if (is_new) fine.vertices.push_back((fine.vertices[a] + fine.vertices[b]).normalized());
    return place->second;
  };
  for (const auto& [a, b, c] : coarse.triangles) {
    const uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
    fine.triangles.insert(fine.triangles.end(),
                          {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
  }
  return fine;
}

}  // namespace

TriangleMesh sphere_mesh(double radius, int subdivisions) {
  assert(radius > 0 && subdivisions >= 0);
  TriangleMesh mesh = unit_icosahedron();
  for (int level = 0; level < subdivisions; ++level) mesh = subdivided_on_sphere(mesh);
  for (Vec3& vertex : mesh.vertices) vertex *= radius;
  return mesh;
}

TriangleMesh cylinder_mesh(double radius, double height, int sides) {
  assert(radius > 0 && height > 0 && sides >= 3);
  TriangleMesh mesh;
  mesh.vertices = {{0, -height / 2, 0}, {0, height / 2, 0}};
  const auto count = static_cast<uint32_t>(sides);
  for (uint32_t side = 0; side < count; ++side) {
    const double angle = 2.0 * kPi * side / count;
    const double x = radius * std::cos(angle), z = radius * std::sin(angle);
    mesh.vertices.emplace_back(x, -height / 2, z);
    mesh.vertices.emplace_back(x, height / 2, z);
  }
  for (uint32_t side = 0; side < count; ++side) {
    const uint32_t low = 2 + 2 * side, next_low = 2 + 2 * ((side + 1) % count);
    const uint32_t high = low + 1, next_high = next_low + 1;
    mesh.triangles.insert(mesh.triangles.end(), {{0, low, next_low},
                                                 {1, next_high, high},
                                                 {low, high, next_high},
                                                 {low, next_high, next_low}});
  }
  return mesh;
}

}  // namespace pilesim
