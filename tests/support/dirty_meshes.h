// Clean meshes, and the damage that other programs do to them.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "core/philox.h"
#include "geometry/primitives.h"
#include "geometry_shapes.h"
#include "support/geometry_concave_shapes.h"

namespace pilesim::test {

struct NamedMesh {
  std::string name;
  TriangleMesh mesh;
};

inline std::vector<NamedMesh> clean_meshes() {
  return {{"torus", torus_mesh(1.0, 0.4, 48, 24)},
          {"l_shape", l_shape_mesh()},
          {"blob", blob_mesh(4)},
          {"can", cylinder_mesh(0.5, 2.0, 40)},
          {"ball", sphere_mesh(1.0, 4)}};
}

// A ball half inside the surface, at its first triangle.
inline TriangleMesh ball_on_surface(const TriangleMesh& mesh) {
  const double radius = 0.12 * mesh.bounds().diagonal().norm();
  const Triangle& t = mesh.triangles.front();
  const Vec3 middle = (mesh.vertices[t[0]] + mesh.vertices[t[1]] + mesh.vertices[t[2]]) / 3;
  return moved(sphere_mesh(radius, 3), {.position = middle + Vec3(0.011, 0.007, 0.013) * radius});
}

struct Dirt {
  std::string name;
  // From a clean mesh. The enclosed volume stays the same, except for `adds`.
  std::function<TriangleMesh(TriangleMesh, Philox&)> make;
  std::function<TriangleMesh(const TriangleMesh&)> adds;  // empty: nothing
};

inline std::vector<Dirt> kinds_of_dirt() {
  using Mesh = TriangleMesh;
  const auto some = [](const Mesh& mesh, Philox& random, double share) {
    std::vector<uint8_t> chosen(mesh.triangles.size(), 0);
    for (uint8_t& each : chosen) {
      const double draw = random.uniform();
      each = draw < share;
    }
    return chosen;
  };
  const auto middle_of_edge = [](Mesh& mesh, uint32_t a, uint32_t b) {
    mesh.vertices.push_back((mesh.vertices[a] + mesh.vertices[b]) / 2);
    return static_cast<uint32_t>(mesh.vertices.size() - 1);
  };
  return {
      {"holes",
       [](Mesh mesh, Philox& random) {
         // Removes single triangles of a mesh fine enough for them to be small.
         for (size_t i = 0; i < 5 && mesh.triangles.size() > 400; ++i) {
           const uint32_t at = random.index(static_cast<uint32_t>(mesh.triangles.size()));
           mesh.triangles.erase(mesh.triangles.begin() + at);
         }
         return mesh;
       },
       {}},
      {"turned patches",
       [some](Mesh mesh, Philox& random) {
         const std::vector<uint8_t> chosen = some(mesh, random, 0.2);
         for (size_t i = 0; i < chosen.size(); ++i) {
           if (chosen[i]) std::swap(mesh.triangles[i][1], mesh.triangles[i][2]);
         }
         return mesh;
       },
       {}},
      {"inside out", [](Mesh mesh, Philox&) { return turned_inside_out(std::move(mesh)); }, {}},
      {"twins",
       [some](Mesh mesh, Philox& random) {
         const std::vector<uint8_t> chosen = some(mesh, random, 0.1);
         for (size_t i = 0; i < chosen.size(); ++i) {
           if (chosen[i]) mesh.triangles.push_back(mesh.triangles[i]);
         }
         return mesh;
       },
       {}},
      {"soup",
       [](Mesh mesh, Philox&) {
         Mesh soup;
         for (const Triangle& t : mesh.triangles) {
           const auto first = static_cast<uint32_t>(soup.vertices.size());
           for (const uint32_t vertex : t) soup.vertices.push_back(mesh.vertices[vertex]);
           soup.triangles.push_back({first, first + 1, first + 2});
         }
         return soup;
       },
       {}},
      {"t-junctions",
       [some, middle_of_edge](Mesh mesh, Philox& random) {
         const std::vector<uint8_t> chosen = some(mesh, random, 0.1);
         for (size_t i = 0; i < chosen.size(); ++i) {
           if (!chosen[i]) continue;
           const auto [a, b, c] = mesh.triangles[i];
           const uint32_t middle = middle_of_edge(mesh, a, b);
           mesh.triangles[i] = {a, middle, c};
           mesh.triangles.push_back({middle, b, c});
         }
         return mesh;
       },
       {}},
      {"flat triangles",
       [some, middle_of_edge](Mesh mesh, Philox& random) {
         const std::vector<uint8_t> chosen = some(mesh, random, 0.1);
         for (size_t i = 0; i < chosen.size(); ++i) {
           if (!chosen[i]) continue;
           const auto [a, b, c] = mesh.triangles[i];
           const uint32_t middle = middle_of_edge(mesh, a, b);
           mesh.triangles[i] = {a, middle, c};
           mesh.triangles.push_back({middle, b, c});
           mesh.triangles.push_back({a, b, middle});
         }
         return mesh;
       },
       {}},
      {"a part that crosses",
       [](Mesh mesh, Philox&) {
         const Mesh ball = ball_on_surface(mesh);
         return joined(std::move(mesh), ball);
       },
       ball_on_surface},
      {"a piece inside",
       [](Mesh mesh, Philox&) {
         // Inside the tube of the torus, and inside all others.
         const Triangle& t = mesh.triangles.front();
         const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
         const Vec3 normal = (b - a).cross(c - a).normalized();
         const double size = 0.05 * mesh.bounds().diagonal().norm();
         const Vec3 place = (a + b + c) / 3 - 2.5 * size * normal;
         return joined(std::move(mesh), moved(sphere_mesh(size, 2), {.position = place}));
       },
       {}},
      {"faces inside",
       [](Mesh mesh, Philox&) {
         const Triangle t = mesh.triangles.front();
         const Vec3 a = mesh.vertices[t[0]], b = mesh.vertices[t[1]], c = mesh.vertices[t[2]];
         const Vec3 normal = (b - a).cross(c - a).normalized();
         const double size = 0.04 * mesh.bounds().diagonal().norm();
         const Vec3 place = (a + b + c) / 3 - 2 * size * normal;
         const auto first = static_cast<uint32_t>(mesh.vertices.size());
         mesh.vertices.push_back(place + size * Vec3(1, 0, 0.1));
         mesh.vertices.push_back(place + size * Vec3(-0.6, 0.7, 0));
         mesh.vertices.push_back(place + size * Vec3(-0.6, -0.7, 0.2));
         mesh.triangles.push_back({first, first + 1, first + 2});
         return mesh;
       },
       {}},
      {"double shell",
       [](Mesh mesh, Philox&) {
         const std::vector<Triangle> all = mesh.triangles;
         mesh.triangles.insert(mesh.triangles.end(), all.begin(), all.end());
         return mesh;
       },
       {}},
      {"fins",
       [](Mesh mesh, Philox& random) {
         for (int i = 0; i < 5; ++i) {
           const uint32_t at = random.index(static_cast<uint32_t>(mesh.triangles.size()));
           const auto [a, b, c] = mesh.triangles[at];
           const Vec3 normal = (mesh.vertices[b] - mesh.vertices[a])
                                   .cross(mesh.vertices[c] - mesh.vertices[a])
                                   .normalized();
           const double size = 0.02 * mesh.bounds().diagonal().norm();
           mesh.vertices.push_back((mesh.vertices[a] + mesh.vertices[b]) / 2 + size * normal);
           mesh.triangles.push_back({a, b, static_cast<uint32_t>(mesh.vertices.size() - 1)});
         }
         return mesh;
       },
       {}},
  };
}

}  // namespace pilesim::test
