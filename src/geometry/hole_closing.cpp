#include "geometry/hole_closing.h"

#include <algorithm>
#include <limits>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include "core/disjoint_sets.h"

namespace pilesim {
namespace {

// Holes across, in diagonals of the mesh and of the piece of surface that has them.
constexpr double kSmallHole = 0.25;
constexpr double kPartOfPiece = 0.5;
// Borders of more edges are closed by a fan, others by triangles of the least area.
constexpr size_t kMostForLeastArea = 80;

using Ring = std::vector<uint32_t>;  // vertices

// Rings of open edges, each vertex with the next. Their direction is any: triangles may have to be
// turned.
std::vector<Ring> borders(const TriangleMesh& mesh) {
  std::map<uint32_t, std::vector<uint32_t>> next;
  for (const HalfEdge& side : open_sides(mesh)) {
    const uint32_t a = side.forward ? side.low : side.high;
    const uint32_t b = side.forward ? side.high : side.low;
    next[a].push_back(b);
    next[b].push_back(a);
  }
  std::vector<Ring> rings;
  std::set<uint32_t> seen;
  for (const auto& [start, ends] : next) {
    if (seen.contains(start)) continue;
    Ring ring = {start};
    seen.insert(start);
    bool is_simple = ends.size() == 2;
    for (uint32_t at = start, from = UINT32_MAX; is_simple;) {
      const auto& both = next.at(at);
      if (both.size() != 2) {
        is_simple = false;
        break;
      }
      const uint32_t to = both[0] != from ? both[0] : both[1];
      from = at;
      at = to;
      if (at == start) break;
      if (!seen.insert(at).second) {
        is_simple = false;
        break;
      }
      ring.push_back(at);
    }
    if (is_simple && ring.size() >= 3) rings.push_back(std::move(ring));
  }
  return rings;
}

// By vertex, the diagonal of its connected piece of surface, m.
std::vector<double> diagonals_of_pieces(const TriangleMesh& mesh) {
  const size_t count = mesh.vertices.size();
  DisjointSets pieces;
  pieces.reset(count);
  for (const auto& [a, b, c] : mesh.triangles) {
    pieces.unite(a, b);
    pieces.unite(a, c);
  }
  std::vector<Bounds> boxes(count);
  for (uint32_t v = 0; v < count; ++v) boxes[pieces.find(v)].extend(mesh.vertices[v]);
  std::vector<double> diagonals(count);
  for (uint32_t v = 0; v < count; ++v) diagonals[v] = boxes[pieces.find(v)].diagonal().norm();
  return diagonals;
}

// A fan about the middle.
void fill_by_fan(const Ring& ring, TriangleMesh& mesh) {
  const size_t n = ring.size();
  Vec3 centre = Vec3::Zero();
  for (const uint32_t vertex : ring) centre += mesh.vertices[vertex] / static_cast<double>(n);
  const auto hub = static_cast<uint32_t>(mesh.vertices.size());
  mesh.vertices.push_back(centre);
  for (size_t i = 0; i < n; ++i) mesh.triangles.push_back({ring[i], ring[(i + 1) % n], hub});
}

// The triangulation of least area (Barequet and Sharir 1995).
void fill_by_least_area(const Ring& ring, TriangleMesh& mesh) {
  const size_t n = ring.size();
  const auto area = [&](size_t i, size_t j, size_t k) {
    const Vec3& a = mesh.vertices[ring[i]];
    return (mesh.vertices[ring[j]] - a).cross(mesh.vertices[ring[k]] - a).norm();
  };
  std::vector<double> least(n * n, 0);
  std::vector<size_t> split(n * n, 0);
  for (size_t span = 2; span < n; ++span) {
    for (size_t i = 0; i + span < n; ++i) {
      const size_t k = i + span;
      least[i * n + k] = std::numeric_limits<double>::infinity();
      for (size_t j = i + 1; j < k; ++j) {
        const double sum = least[i * n + j] + least[j * n + k] + area(i, j, k);
        if (sum >= least[i * n + k]) continue;
        least[i * n + k] = sum;
        split[i * n + k] = j;
      }
    }
  }
  std::vector<std::pair<size_t, size_t>> open = {{0, n - 1}};
  while (!open.empty()) {
    const auto [i, k] = open.back();
    open.pop_back();
    if (k < i + 2) continue;
    const size_t j = split[i * n + k];
    mesh.triangles.push_back({ring[i], ring[j], ring[k]});
    open.emplace_back(i, j);
    open.emplace_back(j, k);
  }
}

}  // namespace

std::vector<HalfEdge> open_sides(const TriangleMesh& mesh) {
  std::vector<HalfEdge> open;
  const HalfEdges sides(mesh.triangles, mesh.vertices.size());
  sides.for_each_edge([&](std::span<const HalfEdge> edge) {
    if (edge.size() == 1) open.push_back(edge[0]);
  });
  std::ranges::sort(open, {},
                    [](const HalfEdge& side) { return std::pair(side.triangle, side.corner); });
  return open;
}

ClosedHoles close_holes(TriangleMesh& mesh, double diagonal_m) {
  ClosedHoles holes;
  const std::vector<Ring> rings = borders(mesh);
  if (rings.empty()) return holes;
  const std::vector<double> piece_m = diagonals_of_pieces(mesh);
  for (const Ring& ring : rings) {
    Bounds box;
    for (const uint32_t vertex : ring) box.extend(mesh.vertices[vertex]);
    const double across = box.diagonal().norm();
    if (across > kSmallHole * diagonal_m || across > kPartOfPiece * piece_m[ring[0]]) {
      holes.largest_opening_m = std::max(holes.largest_opening_m, across);
      continue;
    }
    holes.largest_m = std::max(holes.largest_m, across);
    ++holes.count;
    if (ring.size() > kMostForLeastArea) {
      fill_by_fan(ring, mesh);
    } else {
      fill_by_least_area(ring, mesh);
    }
  }
  return holes;
}

}  // namespace pilesim
