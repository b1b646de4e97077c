#include "generate/swept_surface.h"

#include <cassert>
#include <set>
#include <utility>

namespace pilesim {
namespace {

void add_rings(TriangleMesh& mesh, const std::vector<Ring>& rings) {
  for (const Ring& ring : rings) {
    assert(ring.size() == rings.front().size());
    mesh.vertices.insert(mesh.vertices.end(), ring.begin(), ring.end());
  }
}

// Two triangles for each side between two rings of `count` points that start at vertices `low` and
// `high`.
void join(TriangleMesh& mesh, uint32_t low, uint32_t high, uint32_t count) {
  for (uint32_t i = 0; i < count; ++i) {
    const uint32_t next = (i + 1) % count;
    mesh.triangles.push_back({low + i, low + next, high + next});
    mesh.triangles.push_back({low + i, high + next, high + i});
  }
}

}  // namespace

TriangleMesh loft(const std::vector<Ring>& rings) {
  TriangleMesh mesh;
  add_rings(mesh, rings);
  const auto count = static_cast<uint32_t>(rings.front().size());
  for (uint32_t i = 2; i < count; ++i) mesh.triangles.push_back({0, i, i - 1});
  for (uint32_t ring = 0; ring + 1 < rings.size(); ++ring) {
    join(mesh, ring * count, (ring + 1) * count, count);
  }
  const auto last = static_cast<uint32_t>((rings.size() - 1) * count);
  for (uint32_t i = 2; i < count; ++i) mesh.triangles.push_back({last, last + i - 1, last + i});
  return mesh;
}

TriangleMesh closed_loft(const std::vector<Ring>& rings) {
  TriangleMesh mesh;
  add_rings(mesh, rings);
  const auto count = static_cast<uint32_t>(rings.front().size());
  const auto ring_count = static_cast<uint32_t>(rings.size());
  for (uint32_t ring = 0; ring < ring_count; ++ring) {
    join(mesh, ring * count, (ring + 1) % ring_count * count, count);
  }
  return mesh;
}

void PlaneCells::add(const std::vector<Eigen::Vector2d>& corners) {
  std::vector<uint32_t> cell;
  for (const Eigen::Vector2d& corner : corners) {
    uint32_t index = 0;
    while (index < points.size() && (points[index] - corner).norm() > 1e-9) ++index;
    if (index == points.size()) points.push_back(corner);
    cell.push_back(index);
  }
  cells.push_back(cell);
}

TriangleMesh extrude(const PlaneCells& cells, double depth) {
  TriangleMesh mesh;
  const auto back = static_cast<uint32_t>(cells.points.size());
  for (const double z : {depth / 2, -depth / 2}) {
    for (const auto& point : cells.points) mesh.vertices.emplace_back(point.x(), point.y(), z);
  }
  std::set<std::pair<uint32_t, uint32_t>> edges;
  for (const auto& cell : cells.cells) {
    for (size_t i = 0; i < cell.size(); ++i) {
      edges.emplace(cell[i], cell[(i + 1) % cell.size()]);
      if (i < 2) continue;
      mesh.triangles.push_back({cell[0], cell[i - 1], cell[i]});
      mesh.triangles.push_back({back + cell[0], back + cell[i], back + cell[i - 1]});
    }
  }
  // An edge without its opposite is on the border.
  for (const auto& [a, b] : edges) {
    if (edges.contains({b, a})) continue;
    mesh.triangles.push_back({a, back + a, back + b});
    mesh.triangles.push_back({a, back + b, b});
  }
  return mesh;
}

}  // namespace pilesim
