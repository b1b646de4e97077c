#include "geometry/mesh_repair.h"

#include <algorithm>
#include <cstdio>
#include <tuple>
#include <utility>

#include "core/counted.h"
#include "geometry/box_tree.h"
#include "geometry/facing.h"
#include "geometry/half_edges.h"
#include "geometry/hole_closing.h"

namespace pilesim {
namespace {

// In diagonals of the mesh: lower triangles have no area, nearer vertices lie on an edge.
constexpr double kNoHeight = 1e-9;
constexpr double kOnEdge = 2e-6;

class MeshRepair {
 public:
  explicit MeshRepair(const TriangleMesh& mesh)
      : mesh_{.vertices = mesh.vertices, .triangles = mesh.triangles} {
    for (const Triangle& triangle : triangles_) {
      for (const uint32_t vertex : triangle) used_.extend(vertices_[vertex]);
    }
    diagonal_ = used_.isEmpty() ? 0 : used_.diagonal().norm();
  }

  Repair run(const TriangleMesh& original) {
    Repair repair;
    if (diagonal_ > 0 && !triangles_.empty()) {
      note(drop_twins(), "triangle that was there twice", "triangles that were there twice",
           " dropped");
      note(split_at_vertices(), "edge", "edges", " split where a vertex lies on it");
      note(drop_flat(), "triangle without area", "triangles without area", " dropped");
      const size_t own = triangles_.size();
      note_holes(close_holes(mesh_, diagonal_), repair);
      const Patches patches = turn_triangles(mesh_, own);
      note(patches.turned, "triangle", "triangles", " turned");
      const TurnedPatches turned = turn_patches(mesh_, patches, used_);
      note(turned.inward, "piece that faced inward", "pieces that faced inward", " turned");
      note(turned.dropped, "piece inside of others", "pieces inside of others", " dropped");
    }
    repair.done = std::move(done_);
    if (repair.done.empty()) {
      repair.mesh = original;
    } else {
      repair.mesh = std::move(mesh_);
      repair.mesh.rounding_m = original.rounding_m;
      drop_unused(repair.mesh);
    }
    return repair;
  }

 private:
  void note(size_t count, const char* one, const char* many, const char* what) {
    if (count > 0) done_.push_back(counted(count, one, many) + what);
  }

  void note_holes(const ClosedHoles& holes, Repair& repair) {
    repair.largest_hole_m = holes.largest_m;
    repair.largest_opening_m = holes.largest_opening_m;
    if (holes.count == 0) return;
    char across[32];
    std::snprintf(across, sizeof across, "%.3g", holes.largest_m);
    done_.push_back(counted(holes.count, "hole") + " closed, the largest " + across + " m across");
  }

  size_t keep(const std::vector<uint8_t>& is_kept) {
    const size_t before = triangles_.size();
    size_t next = 0;
    for (size_t i = 0; i < before; ++i) {
      if (is_kept[i]) triangles_[next++] = triangles_[i];
    }
    triangles_.resize(next);
    return before - next;
  }

  // Triangles with the same corners and orientation become one; pairs that face each other go.
  size_t drop_twins() {
    struct Twin {
      Triangle sorted;  // its corners
      uint32_t triangle;
    };
    std::vector<Twin> all;
    all.reserve(triangles_.size());
    for (uint32_t i = 0; i < triangles_.size(); ++i) {
      all.push_back({triangles_[i], i});
      std::ranges::sort(all.back().sorted);
    }
    std::ranges::sort(all, [](const Twin& a, const Twin& b) {
      return std::tie(a.sorted, a.triangle) < std::tie(b.sorted, b.triangle);
    });
    std::vector<uint8_t> is_kept(triangles_.size(), 1);
    for (auto first = all.begin(); first != all.end();) {
      const auto last = std::find_if(
          first, all.end(), [&](const Twin& twin) { return twin.sorted != first->sorted; });
      std::vector<uint32_t> ways[2];
      for (auto each = first; last - first > 1 && each != last; ++each) {
        const Triangle& t = triangles_[each->triangle];
        const size_t lowest = static_cast<size_t>(std::ranges::min_element(t) - t.begin());
        ways[t[(lowest + 1) % 3] < t[(lowest + 2) % 3]].push_back(each->triangle);
      }
      const bool is_double = !ways[0].empty() && !ways[1].empty();
      for (const auto& way : ways) {
        for (size_t k = is_double ? 0 : 1; k < way.size(); ++k) is_kept[way[k]] = 0;
      }
      first = last;
    }
    return keep(is_kept);
  }

  double height_of(const Triangle& t) const {
    const Vec3 &a = vertices_[t[0]], &b = vertices_[t[1]], &c = vertices_[t[2]];
    const double longest = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
    return longest > 0 ? (b - a).cross(c - a).norm() / longest : 0;
  }

  // A flat triangle lies along its longest edge: the neighbour there gets its middle vertex.
  size_t drop_flat() {
    size_t dropped = 0;
    for (int round = 0; round < 8; ++round) {
      std::vector<uint8_t> is_kept(triangles_.size(), 1);
      std::vector<uint8_t> is_touched(triangles_.size(), 0);
      const HalfEdges sides(triangles_, vertices_.size());
      std::vector<Triangle> added;
      size_t flat = 0;
      for (uint32_t i = 0; i < is_kept.size(); ++i) {
        const Triangle t = triangles_[i];
        if (is_touched[i] || height_of(t) > kNoHeight * diagonal_) continue;
        uint32_t longest = 0;
        for (uint32_t k = 1; k < 3; ++k) {
          const auto length = [&](uint32_t c) {
            return (vertices_[t[(c + 1) % 3]] - vertices_[t[c]]).squaredNorm();
          };
          if (length(k) > length(longest)) longest = k;
        }
        const uint32_t a = t[longest], b = t[(longest + 1) % 3], middle = t[(longest + 2) % 3];
        const std::span<const HalfEdge> both = sides.along(a, b);
        ++flat;
        is_kept[i] = 0;
        is_touched[i] = 1;
        if (both.size() != 2) continue;
        const HalfEdge& other = both[0].triangle == i ? both[1] : both[0];
        if (is_touched[other.triangle]) {
          is_kept[i] = 1;  // in the next round
          continue;
        }
        const Triangle n = triangles_[other.triangle];
        const uint32_t from = n[other.corner], to = n[(other.corner + 1U) % 3];
        const uint32_t tip = n[(other.corner + 2U) % 3];
        is_kept[other.triangle] = 0;
        is_touched[other.triangle] = 1;
        if (tip == middle) continue;  // a pocket without inside
        added.push_back({from, middle, tip});
        added.push_back({middle, to, tip});
      }
      dropped += flat;
      if (flat == 0) break;
      keep(is_kept);
      triangles_.insert(triangles_.end(), added.begin(), added.end());
    }
    return dropped;
  }

  // Open edges that run past vertices of other open edges.
  size_t split_at_vertices() {
    size_t splits = 0;
    for (int round = 0; round < 6; ++round) {
      const std::vector<HalfEdge> open = open_sides(mesh_);
      if (open.empty() || open.size() > 200'000) break;
      std::vector<uint32_t> ends;
      std::vector<Bounds> boxes;
      std::vector<Vec3> centres;
      for (const HalfEdge& side : open) ends.push_back(triangles_[side.triangle][side.corner]);
      std::ranges::sort(ends);
      ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
      for (const uint32_t vertex : ends) {
        boxes.emplace_back(vertices_[vertex], vertices_[vertex]);
        centres.push_back(vertices_[vertex]);
      }
      const BoxTree tree(boxes, centres, 4);
      std::vector<uint8_t> is_touched(triangles_.size(), 0);
      size_t now = 0;
      for (const HalfEdge& side : open) {
        if (is_touched[side.triangle]) continue;
        const Triangle t = triangles_[side.triangle];
        const uint32_t from = t[side.corner], to = t[(side.corner + 1U) % 3],
                       tip = t[(side.corner + 2U) % 3];
        const Vec3 &a = vertices_[from], &b = vertices_[to];
        const double length = (b - a).norm(), near = kOnEdge * diagonal_;
        Bounds box(a.cwiseMin(b).array() - near, a.cwiseMax(b).array() + near);
        uint32_t on = tip;
        double first = 1;
        tree.for_each_near(box, 0, [&](uint32_t i) {
          const uint32_t vertex = ends[tree.items()[i]];
          if (vertex == from || vertex == to || vertex == tip) return;
          const double along = (vertices_[vertex] - a).dot(b - a) / (length * length);
          const double beside = (vertices_[vertex] - a - along * (b - a)).norm();
          if (beside > near || along * length < near || (1 - along) * length < near) return;
          if (along < first) {
            first = along;
            on = vertex;
          }
        });
        if (on == tip) continue;
        is_touched[side.triangle] = 1;
        triangles_[side.triangle] = {from, on, tip};
        triangles_.push_back({on, to, tip});
        is_touched.push_back(1);
        ++now;
      }
      splits += now;
      if (now == 0) break;
    }
    return splits;
  }

  static void drop_unused(TriangleMesh& mesh) {
    std::vector<uint32_t> place(mesh.vertices.size(), UINT32_MAX);
    std::vector<Vec3> used;
    for (Triangle& triangle : mesh.triangles) {
      for (uint32_t& vertex : triangle) {
        if (place[vertex] == UINT32_MAX) {
          place[vertex] = static_cast<uint32_t>(used.size());
          used.push_back(mesh.vertices[vertex]);
        }
        vertex = place[vertex];
      }
    }
    mesh.vertices = std::move(used);
  }

  TriangleMesh mesh_;
  std::vector<Vec3>& vertices_ = mesh_.vertices;
  std::vector<Triangle>& triangles_ = mesh_.triangles;
  std::vector<std::string> done_;
  Bounds used_;
  double diagonal_ = 0;
};

}  // namespace

Repair repair_mesh(const TriangleMesh& mesh) { return MeshRepair(mesh).run(mesh); }

}  // namespace pilesim
