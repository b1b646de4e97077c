#include "render/render_mesh.h"

#include <meshoptimizer.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <tuple>

#include "geometry/triangle_tree.h"

namespace pilesim {
namespace {

// All but the normals.
CornerMesh weld(std::span<const Vec3f> vertices,
                std::span<const std::array<uint32_t, 3>> triangles) {
  if (triangles.empty()) return {};  // else meshoptimizer takes vertices for triangles
  std::vector<uint32_t> corners;
  corners.reserve(triangles.size() * 3);
  for (const auto& triangle : triangles) {
    corners.insert(corners.end(), triangle.begin(), triangle.end());
  }
  std::vector<uint32_t> remap(vertices.size());
  const size_t count = meshopt_generateVertexRemap(remap.data(), corners.data(), corners.size(),
                                                   vertices.data(), vertices.size(), sizeof(Vec3f));
  CornerMesh welded;
  welded.positions.resize(count);
  meshopt_remapVertexBuffer(welded.positions.data(), vertices.data(), vertices.size(),
                            sizeof(Vec3f), remap.data());
  for (size_t i = 0; i < corners.size(); i += 3) {
    const uint32_t a = remap[corners[i]], b = remap[corners[i + 1]], c = remap[corners[i + 2]];
    if (a == b || b == c || c == a) continue;
    welded.corners.insert(welded.corners.end(), {a, b, c});
    welded.source.push_back(static_cast<uint32_t>(i / 3));
  }
  return welded;
}

// Disjoint sets over corners: corners of one set share a normal.
class CornerSets {
 public:
  explicit CornerSets(size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), 0u);
  }
  uint32_t find(uint32_t corner) {
    while (parent_[corner] != corner) corner = parent_[corner] = parent_[parent_[corner]];
    return corner;
  }
  void unite(uint32_t a, uint32_t b) {
    a = find(a);
    b = find(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<uint32_t> parent_;
};

struct Edge {
  uint32_t low, high;                // vertices
  uint32_t low_corner, high_corner;  // of the triangle at those vertices
  bool forward;                      // the triangle runs from low to high

  bool operator<(const Edge& other) const {
    return std::tie(low, high, low_corner) < std::tie(other.low, other.high, other.low_corner);
  }
};

std::vector<Edge> sorted_edges(const std::vector<uint32_t>& corners) {
  std::vector<Edge> edges;
  edges.reserve(corners.size());
  for (uint32_t i = 0; i < corners.size(); ++i) {
    const uint32_t next = i % 3 == 2 ? i - 2 : i + 1;
    const bool forward = corners[i] < corners[next];
    edges.push_back(forward ? Edge{corners[i], corners[next], i, next, true}
                            : Edge{corners[next], corners[i], next, i, false});
  }
  std::sort(edges.begin(), edges.end());
  return edges;
}

bool same_edge(const Edge& a, const Edge& b) { return a.low == b.low && a.high == b.high; }

bool is_closed(const std::vector<Edge>& edges) {
  for (size_t i = 0; i < edges.size(); i += 2) {
    if (i + 1 == edges.size() || !same_edge(edges[i], edges[i + 1])) return false;
    if (edges[i].forward == edges[i + 1].forward) return false;
    if (i + 2 < edges.size() && same_edge(edges[i], edges[i + 2])) return false;
  }
  return !edges.empty();
}

// The normal of each corner: faces joined by edges flatter than the crease angle, weighted by their
// angle at the vertex.
std::vector<Vec3f> corner_normals(const CornerMesh& mesh, const std::vector<Edge>& edges) {
  const size_t corner_count = mesh.corners.size();
  std::vector<Vec3f> face_normal(corner_count / 3);
  std::vector<float> corner_angle(corner_count);
  for (size_t face = 0; face < face_normal.size(); ++face) {
    std::array<Vec3f, 3> p;
    for (size_t k = 0; k < 3; ++k) p[k] = mesh.positions[mesh.corners[3 * face + k]];
    const Vec3f normal = (p[1] - p[0]).cross(p[2] - p[0]);
    face_normal[face] = normal.norm() > 0 ? Vec3f(normal.normalized()) : Vec3f(Vec3f::Zero());
    for (size_t k = 0; k < 3; ++k) {
      const Vec3f u = p[(k + 1) % 3] - p[k];
      const Vec3f v = p[(k + 2) % 3] - p[k];
      corner_angle[3 * face + k] = std::atan2(u.cross(v).norm(), u.dot(v));
    }
  }

  const auto crease_cosine = static_cast<float>(std::cos(kCreaseAngle));
  CornerSets sets(corner_count);
  for (size_t i = 0; i + 1 < edges.size(); ++i) {
    const Edge& a = edges[i];
    const Edge& b = edges[i + 1];
    if (!same_edge(a, b)) continue;
    if (face_normal[a.low_corner / 3].dot(face_normal[b.low_corner / 3]) < crease_cosine) continue;
    sets.unite(a.low_corner, b.low_corner);
    sets.unite(a.high_corner, b.high_corner);
  }

  std::vector<Vec3f> sum(corner_count, Vec3f::Zero());
  for (uint32_t i = 0; i < corner_count; ++i) {
    sum[sets.find(i)] += corner_angle[i] * face_normal[i / 3];
  }
  std::vector<Vec3f> normals(corner_count);
  for (uint32_t i = 0; i < corner_count; ++i) {
    const Vec3f& normal = sum[sets.find(i)];
    normals[i] = normal.norm() > 1e-6f ? Vec3f(normal.normalized()) : face_normal[i / 3];
  }
  return normals;
}

// One vertex for each place, normal and paint, or place in a texture.
void index_vertices(const CornerMesh& mesh, std::span<const Colour> colours, const TextureMap& map,
                    std::vector<RenderVertex>& vertices, std::vector<uint32_t>& indices) {
  std::vector<RenderVertex> corners(mesh.corners.size());
  for (size_t i = 0; i < corners.size(); ++i) {
    const Vec3f& p = mesh.positions[mesh.corners[i]];
    const uint32_t source = mesh.source[i / 3];
    RenderVertex& corner = corners[i];
    corner.position = {p.x(), p.y(), p.z()};
    corner.normal = {mesh.normals[i].x(), mesh.normals[i].y(), mesh.normals[i].z()};
    if (!map.empty() && map.texture[source] != 0) {
      corner.texture = map.texture[source];
      corner.uv = map.corners[source][i % 3];
    } else if (!colours.empty()) {
      corner.paint = pack_material(colours[source], 255);
    }
  }
  std::vector<uint32_t> remap(corners.size());
  const size_t count = meshopt_generateVertexRemap(
      remap.data(), nullptr, corners.size(), corners.data(), corners.size(), sizeof(RenderVertex));
  vertices.resize(count);
  meshopt_remapVertexBuffer(vertices.data(), corners.data(), corners.size(), sizeof(RenderVertex),
                            remap.data());
  indices = std::move(remap);
}

// Texture of a triangle. Rough simplification joins different ones; shaders take flat values from
// the last corner.
uint32_t texture_of(const std::vector<RenderVertex>& vertices, const uint32_t* corners) {
  return vertices[corners[2]].texture;
}

// The triangles texture by texture, each texture's in an order that is good for the vertex cache.
std::vector<TextureRun> order_by_texture(const std::vector<RenderVertex>& vertices,
                                         std::vector<uint32_t>& indices, uint32_t first_index) {
  const auto texture_at = [&](size_t i) { return texture_of(vertices, &indices[i]); };
  uint32_t last = 0;
  for (size_t i = 0; i < indices.size(); i += 3) last = std::max(last, texture_at(i));
  std::vector<TextureRun> runs;
  std::vector<uint32_t> ordered;
  for (uint32_t texture = 0; texture <= last; ++texture) {
    const size_t first = ordered.size();
    for (size_t i = 0; i < indices.size(); i += 3) {
      if (texture_at(i) != texture) continue;
      ordered.insert(ordered.end(), {indices[i], indices[i + 1], indices[i + 2]});
    }
    const size_t count = ordered.size() - first;
    if (count == 0) continue;
    meshopt_optimizeVertexCache(&ordered[first], &ordered[first], count, vertices.size());
    runs.push_back(
        {texture, first_index + static_cast<uint32_t>(first), static_cast<uint32_t>(count)});
  }
  indices = std::move(ordered);
  return runs;
}

// Appends a level with its own compact run of vertices, in the order in which they are used.
void append_level(RenderMesh& mesh, const std::vector<RenderVertex>& vertices,
                  std::vector<uint32_t> indices, float error_m) {
  MeshLevel level;
  level.first_index = static_cast<uint32_t>(mesh.indices.size());
  level.index_count = static_cast<uint32_t>(indices.size());
  level.first_vertex = static_cast<uint32_t>(mesh.vertices.size());
  level.error_m = error_m;
  level.runs = order_by_texture(vertices, indices, level.first_index);
  std::vector<RenderVertex> own(vertices.size());
  own.resize(meshopt_optimizeVertexFetch(own.data(), indices.data(), indices.size(),
                                         vertices.data(), vertices.size(), sizeof(RenderVertex)));
  mesh.vertices.insert(mesh.vertices.end(), own.begin(), own.end());
  mesh.indices.insert(mesh.indices.end(), indices.begin(), indices.end());
  mesh.levels.push_back(std::move(level));
}

// A triangle of a textured mesh.
struct Patch {
  Corners place;  // m
  std::array<Eigen::Vector2d, 3> uv;
  uint32_t texture;

  Patch(const std::vector<RenderVertex>& vertices, const uint32_t* corners)
      : texture(texture_of(vertices, corners)) {
    for (size_t k = 0; k < 3; ++k) {
      const RenderVertex& vertex = vertices[corners[k]];
      place[k] = {vertex.position[0], vertex.position[1], vertex.position[2]};
      uv[k] = {vertex.uv[0], vertex.uv[1]};
    }
  }
  double doubled_area() const { return (place[1] - place[0]).cross(place[2] - place[0]).norm(); }
  double doubled_uv_area() const {
    const Eigen::Vector2d a = uv[1] - uv[0], b = uv[2] - uv[0];
    return std::abs(a.x() * b.y() - a.y() * b.x());
  }
  // At a point of the triangle.
  Eigen::Vector2d uv_at(const Vec3& point) const {
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    double area = 0;
    for (size_t k = 0; k < 3; ++k) {
      const double opposite = (place[(k + 1) % 3] - point).cross(place[(k + 2) % 3] - point).norm();
      sum += opposite * uv[k];
      area += opposite;
    }
    return area > 0 ? Eigen::Vector2d(sum / area) : uv[0];
  }
};

// Samples for the error of textures, spread evenly over all triangles.
constexpr size_t kTextureSamples = 1000;

// How far what textures show moves where `simplified` takes the place of `indices`, m: that in the
// middles of triangles, as the root of its mean square by area. `error_m`: of the surface itself.
float texture_error(const std::vector<RenderVertex>& vertices, const std::vector<uint32_t>& indices,
                    const std::vector<uint32_t>& simplified, double error_m) {
  TriangleMesh surface;
  for (const RenderVertex& vertex : vertices) {
    surface.vertices.emplace_back(vertex.position[0], vertex.position[1], vertex.position[2]);
  }
  for (size_t i = 0; i < simplified.size(); i += 3) {
    surface.triangles.push_back({simplified[i], simplified[i + 1], simplified[i + 2]});
  }
  const TriangleTree tree(surface);
  const double reach = 2 * error_m + 1e-4 * surface.bounds().diagonal().norm();
  double sum = 0, area = 0;
  const size_t step = 3 * std::max<size_t>(1, indices.size() / 3 / kTextureSamples);
  for (size_t i = 0; i < indices.size(); i += step) {
    const Patch patch(vertices, &indices[i]);
    if (patch.texture == 0 || patch.doubled_uv_area() <= 0) continue;
    const Vec3 middle = (patch.place[0] + patch.place[1] + patch.place[2]) / 3;
    const Eigen::Vector2d uv = (patch.uv[0] + patch.uv[1] + patch.uv[2]) / 3;
    const double m_per_uv = std::sqrt(patch.doubled_area() / patch.doubled_uv_area());
    const Vec3 around = Vec3::Constant(reach);
    double least = std::numeric_limits<double>::infinity();
    tree.for_each_near(Bounds(middle - around, middle + around), 0, [&](uint32_t k) {
      const Patch other(vertices, surface.triangles[tree.triangles()[k]].data());
      if (other.texture != patch.texture) return;
      const Vec3 nearest = closest_point(other.place, middle);
      const Eigen::Array2d off = other.uv_at(nearest) - uv;
      const double moved = m_per_uv * (off - off.round()).matrix().norm();  // it repeats
      least = std::min(least, std::hypot(moved, (nearest - middle).norm()));
    });
    if (std::isinf(least)) least = reach;
    sum += patch.doubled_area() * least * least;
    area += patch.doubled_area();
  }
  return area > 0 ? static_cast<float>(std::sqrt(sum / area)) : 0;
}

// Halves the triangles level by level down to about this many.
constexpr size_t kCoarsestTriangles = 24;

void append_simplified_levels(RenderMesh& mesh, const std::vector<RenderVertex>& vertices,
                              const std::vector<uint32_t>& indices) {
  const float* positions = vertices.front().position.data();
  const float scale = meshopt_simplifyScale(positions, vertices.size(), sizeof(RenderVertex));
  const bool has_textures =
      std::ranges::any_of(vertices, [](const RenderVertex& vertex) { return vertex.texture != 0; });
  size_t previous = indices.size();
  for (size_t target = indices.size() / 6; target >= kCoarsestTriangles; target /= 2) {
    std::vector<uint32_t> simplified(indices.size());
    float error = 0;
    size_t count =
        meshopt_simplify(simplified.data(), indices.data(), indices.size(), positions,
                         vertices.size(), sizeof(RenderVertex), target * 3, 1.0f, 0, &error);
    // Creases and borders may stop the careful simplifier; from afar its rough sister will do.
    if (count > target * 3 + target) {
      count =
          meshopt_simplifySloppy(simplified.data(), indices.data(), indices.size(), positions,
                                 vertices.size(), sizeof(RenderVertex), target * 3, 1.0f, &error);
    }
    if (count == 0 || count >= previous - previous / 8) continue;
    previous = count;
    simplified.resize(count);
    float error_m = error * scale;
    if (has_textures) {
      error_m = std::max(error_m, texture_error(vertices, indices, simplified, error_m));
    }
    append_level(mesh, vertices, std::move(simplified),
                 std::max(error_m, mesh.levels.back().error_m));
  }
}

float mean_chord(const CornerMesh& mesh) {
  double volume = 0, surface = 0;
  for (size_t i = 0; i < mesh.corners.size(); i += 3) {
    const Vec3 a = mesh.positions[mesh.corners[i]].cast<double>();
    const Vec3 b = mesh.positions[mesh.corners[i + 1]].cast<double>();
    const Vec3 c = mesh.positions[mesh.corners[i + 2]].cast<double>();
    volume += a.dot(b.cross(c)) / 6;
    surface += (b - a).cross(c - a).norm() / 2;
  }
  return static_cast<float>(4 * std::abs(volume) / surface);
}

}  // namespace

PackedMaterial pack_material(const Colour& colour, uint8_t kind) {
  PackedMaterial material{0, 0, 0, kind};
  for (size_t i = 0; i < 3; ++i) {
    material[i] = static_cast<uint8_t>(std::lround(255 * std::sqrt(linear_from_srgb(colour[i]))));
  }
  return material;
}

CornerMesh make_corner_mesh(std::span<const Vec3f> vertices,
                            std::span<const std::array<uint32_t, 3>> triangles) {
  CornerMesh mesh = weld(vertices, triangles);
  mesh.normals = corner_normals(mesh, sorted_edges(mesh.corners));
  return mesh;
}

RenderMesh make_render_mesh(std::span<const Vec3f> vertices,
                            std::span<const std::array<uint32_t, 3>> triangles,
                            std::span<const Colour> colours, const TextureMap& map) {
  RenderMesh mesh;
  CornerMesh welded = weld(vertices, triangles);
  if (welded.corners.empty()) {
    mesh.levels.emplace_back();
    return mesh;
  }
  const std::vector<Edge> edges = sorted_edges(welded.corners);
  mesh.closed = is_closed(edges);
  for (const uint32_t corner : welded.corners) {
    mesh.radius_m = std::max(mesh.radius_m, welded.positions[corner].norm());
  }
  if (mesh.closed) mesh.mean_chord_m = mean_chord(welded);
  std::vector<RenderVertex> split;
  std::vector<uint32_t> indices;
  welded.normals = corner_normals(welded, edges);
  index_vertices(welded, colours, map, split, indices);
  append_level(mesh, split, indices, 0);
  append_simplified_levels(mesh, split, indices);
  return mesh;
}

RenderMesh make_plain_mesh(std::span<const Vec3f> vertices,
                           std::span<const std::array<uint32_t, 3>> triangles) {
  RenderMesh mesh;
  mesh.vertices.reserve(vertices.size());
  for (const Vec3f& p : vertices) mesh.vertices.push_back({.position = {p.x(), p.y(), p.z()}});
  mesh.indices.reserve(3 * triangles.size());
  for (const auto& triangle : triangles) {
    mesh.indices.insert(mesh.indices.end(), triangle.begin(), triangle.end());
  }
  for (const uint32_t i : mesh.indices) mesh.radius_m = std::max(mesh.radius_m, vertices[i].norm());
  mesh.levels.push_back({.index_count = static_cast<uint32_t>(mesh.indices.size())});
  return mesh;
}

}  // namespace pilesim
