#include "geometry/mesh_repair.h"

#include <algorithm>
#include <limits>
#include <map>
#include <numeric>
#include <set>
#include <unordered_map>

#include "core/counted.h"
#include "geometry/inside_test.h"
#include "geometry/triangle_tree.h"

namespace pilesim {
namespace {

// In diagonals of the mesh: what is lower has no area, what is nearer lies on an edge.
constexpr double kNoHeight = 1e-9;
constexpr double kOnEdge = 2e-6;
// Holes across, in diagonals of the mesh and of the piece of surface that has them.
constexpr double kSmallHole = 0.25;
constexpr double kPartOfPiece = 0.5;
// Borders of more edges are closed by a fan, others by triangles of the least area.
constexpr size_t kMostForLeastArea = 80;
// Just outside of a surface, in diagonals of the mesh.
constexpr double kJustOutside = 1e-7;

using EdgeKey = uint64_t;
EdgeKey key_of(uint32_t a, uint32_t b) { return uint64_t{std::min(a, b)} << 32 | std::max(a, b); }

// One end of a triangle's edge.
struct Side {
  uint32_t triangle;
  uint32_t corner;  // the edge runs from here to the next corner
};
using Sides = std::unordered_map<EdgeKey, std::vector<Side>>;

Sides sides_of(const std::vector<Triangle>& triangles) {
  Sides sides;
  sides.reserve(2 * triangles.size());
  for (uint32_t i = 0; i < triangles.size(); ++i) {
    for (uint32_t k = 0; k < 3; ++k) {
      sides[key_of(triangles[i][k], triangles[i][(k + 1) % 3])].push_back({i, k});
    }
  }
  return sides;
}

class MeshRepair {
 public:
  explicit MeshRepair(const TriangleMesh& mesh)
      : vertices_(mesh.vertices), triangles_(mesh.triangles) {
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
      close_holes(repair);
      note(turn_triangles(), "triangle", "triangles", " turned");
      place_pieces();
    }
    repair.done = std::move(done_);
    if (repair.done.empty()) {
      repair.mesh = original;
    } else {
      repair.mesh.vertices = std::move(vertices_);
      repair.mesh.triangles = std::move(triangles_);
      repair.mesh.rounding_m = original.rounding_m;
      drop_unused(repair.mesh);
    }
    return repair;
  }

 private:
  void note(size_t count, const char* one, const char* many, const char* what) {
    if (count > 0) done_.push_back(counted(count, one, many) + what);
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
    std::map<std::array<uint32_t, 3>, std::vector<uint32_t>> alike;
    for (uint32_t i = 0; i < triangles_.size(); ++i) {
      std::array<uint32_t, 3> sorted = triangles_[i];
      std::ranges::sort(sorted);
      alike[sorted].push_back(i);
    }
    std::vector<uint8_t> is_kept(triangles_.size(), 1);
    for (const auto& [corners, all] : alike) {
      if (all.size() == 1) continue;
      std::vector<uint32_t> ways[2];
      for (const uint32_t i : all) {
        const Triangle& t = triangles_[i];
        const size_t lowest = static_cast<size_t>(std::ranges::min_element(t) - t.begin());
        ways[t[(lowest + 1) % 3] < t[(lowest + 2) % 3]].push_back(i);
      }
      for (const auto& way : ways) {
        const bool is_double = !ways[0].empty() && !ways[1].empty();
        for (size_t k = is_double ? 0 : 1; k < way.size(); ++k) is_kept[way[k]] = 0;
      }
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
      const Sides sides = sides_of(triangles_);
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
        const auto& both = sides.at(key_of(a, b));
        ++flat;
        is_kept[i] = 0;
        is_touched[i] = 1;
        if (both.size() != 2) continue;
        const Side other = both[0].triangle == i ? both[1] : both[0];
        if (is_touched[other.triangle]) {
          is_kept[i] = 1;  // in the next round
          continue;
        }
        const Triangle n = triangles_[other.triangle];
        const uint32_t from = n[other.corner], to = n[(other.corner + 1) % 3];
        const uint32_t tip = n[(other.corner + 2) % 3];
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

  std::vector<Side> open_sides() const {
    std::vector<Side> open;
    for (const auto& [key, both] : sides_of(triangles_)) {
      if (both.size() == 1) open.push_back(both[0]);
    }
    std::ranges::sort(open, [](const Side& a, const Side& b) {
      return std::pair(a.triangle, a.corner) < std::pair(b.triangle, b.corner);
    });
    return open;
  }

  // Open edges that run past vertices of other open edges.
  size_t split_at_vertices() {
    size_t splits = 0;
    for (int round = 0; round < 6; ++round) {
      const std::vector<Side> open = open_sides();
      if (open.empty() || open.size() > 200'000) break;
      std::vector<uint32_t> ends;
      std::vector<Bounds> boxes;
      std::vector<Vec3> centres;
      for (const Side& side : open) ends.push_back(triangles_[side.triangle][side.corner]);
      std::ranges::sort(ends);
      ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
      for (const uint32_t vertex : ends) {
        boxes.emplace_back(vertices_[vertex], vertices_[vertex]);
        centres.push_back(vertices_[vertex]);
      }
      const BoxTree tree(boxes, centres, 4);
      std::vector<uint8_t> is_touched(triangles_.size(), 0);
      size_t now = 0;
      for (const Side& side : open) {
        if (is_touched[side.triangle]) continue;
        const Triangle t = triangles_[side.triangle];
        const uint32_t from = t[side.corner], to = t[(side.corner + 1) % 3],
                       tip = t[(side.corner + 2) % 3];
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

  // Neighbours over an edge of two run along it in opposite directions. The larger part of a patch
  // of surface decides; whether it is inside out is decided later.
  size_t turn_triangles() {
    const Sides sides = sides_of(triangles_);
    piece_.assign(triangles_.size(), UINT32_MAX);
    pieces_ = 0;
    size_t turned = 0;
    std::vector<uint8_t> is_turned(triangles_.size(), 0);
    for (uint32_t seed = 0; seed < triangles_.size(); ++seed) {
      if (piece_[seed] != UINT32_MAX) continue;
      std::vector<uint32_t> patch = {seed};
      piece_[seed] = pieces_;
      for (size_t next = 0; next < patch.size(); ++next) {
        const uint32_t i = patch[next];
        for (uint32_t k = 0; k < 3; ++k) {
          const uint32_t from = triangles_[i][k], to = triangles_[i][(k + 1) % 3];
          const auto& both = sides.at(key_of(from, to));
          if (both.size() != 2) continue;
          const Side other = both[0].triangle == i ? both[1] : both[0];
          if (piece_[other.triangle] != UINT32_MAX) continue;
          const bool runs_alike = triangles_[other.triangle][other.corner] == from;
          is_turned[other.triangle] = is_turned[i] != runs_alike;
          piece_[other.triangle] = pieces_;
          patch.push_back(other.triangle);
        }
      }
      double area[2] = {0, 0};
      for (const uint32_t i : patch) area[is_turned[i]] += area_of(i);
      const uint8_t less = area[1] > area[0] ? 0 : 1;
      for (const uint32_t i : patch) {
        if (is_turned[i] != less) continue;
        std::swap(triangles_[i][1], triangles_[i][2]);
        if (i < own_) ++turned;
      }
      ++pieces_;
    }
    return turned;
  }

  double area_of(uint32_t i) const {
    const Triangle& t = triangles_[i];
    return (vertices_[t[1]] - vertices_[t[0]]).cross(vertices_[t[2]] - vertices_[t[0]]).norm() / 2;
  }

  // Closed pieces face outward, or inward where they bound a hollow of another one; those that lie
  // inside of another one and are none go.
  void place_pieces() {
    std::vector<double> volume(pieces_, 0);
    std::vector<uint8_t> is_open(pieces_, 0);
    std::vector<uint32_t> largest(pieces_, UINT32_MAX);
    const Vec3 middle = used_.center();
    for (uint32_t i = 0; i < triangles_.size(); ++i) {
      const Triangle& t = triangles_[i];
      const Vec3 a = vertices_[t[0]] - middle, b = vertices_[t[1]] - middle;
      volume[piece_[i]] += a.dot(b.cross(vertices_[t[2]] - middle)) / 6;
      uint32_t& best = largest[piece_[i]];
      if (best == UINT32_MAX || area_of(i) > area_of(best)) best = i;
    }
    for (const auto& [key, both] : sides_of(triangles_)) {
      if (both.size() != 2) {
        for (const Side& side : both) is_open[piece_[side.triangle]] = 1;
      }
    }
    if (std::ranges::find(is_open, 1) != is_open.end()) return;  // for the wrap
    std::vector<uint8_t> was_inward(pieces_, 0);
    size_t inward = 0;
    for (uint32_t p = 0; p < pieces_; ++p) was_inward[p] = volume[p] < 0;
    turn_pieces(was_inward);
    std::vector<uint8_t> is_hollow(pieces_, 0), is_inside(pieces_, 0);
    if (pieces_ > 1) {
      const InsideTest inside({.vertices = vertices_, .triangles = triangles_});
      for (uint32_t p = 0; p < pieces_; ++p) {
        const Triangle& t = triangles_[largest[p]];
        const Vec3 &a = vertices_[t[0]], &b = vertices_[t[1]], &c = vertices_[t[2]];
        const Vec3 normal = (b - a).cross(c - a).normalized();
        const Vec3 outside = (a + b + c) / 3 + kJustOutside * diagonal_ * normal;
        if (inside.winding_number(outside) < 0.5) continue;
        (was_inward[p] ? is_hollow : is_inside)[p] = 1;
      }
    }
    turn_pieces(is_hollow);
    for (uint32_t p = 0; p < pieces_; ++p) inward += was_inward[p] && !is_hollow[p];
    note(inward, "piece that faced inward", "pieces that faced inward", " turned");
    const auto nested = static_cast<size_t>(std::ranges::count(is_inside, 1));
    // Two that cross are inside each other in places: those are not for here.
    if (nested == 0 || nested == pieces_) return;
    std::vector<uint8_t> is_kept(triangles_.size());
    for (size_t i = 0; i < is_kept.size(); ++i) is_kept[i] = !is_inside[piece_[i]];
    drop_nested(is_inside, is_kept, nested);
  }

  // Only pieces all of whose vertices lie inside of the others.
  void drop_nested(const std::vector<uint8_t>& is_inside, std::vector<uint8_t>& is_kept,
                   size_t nested) {
    TriangleMesh others{.vertices = vertices_, .triangles = {}};
    for (size_t i = 0; i < triangles_.size(); ++i) {
      if (is_kept[i]) others.triangles.push_back(triangles_[i]);
    }
    if (others.triangles.empty()) return;
    const InsideTest inside(others);
    std::vector<uint8_t> crosses(is_inside.size(), 0);
    for (size_t i = 0; i < triangles_.size(); ++i) {
      if (is_kept[i] || crosses[piece_[i]]) continue;
      for (const uint32_t vertex : triangles_[i]) {
        if (!inside.contains(vertices_[vertex])) crosses[piece_[i]] = 1;
      }
    }
    for (size_t i = 0; i < triangles_.size(); ++i) {
      if (crosses[piece_[i]]) is_kept[i] = 1;
    }
    nested -= static_cast<size_t>(std::ranges::count(crosses, 1));
    keep(is_kept);
    note(nested, "piece inside of others", "pieces inside of others", " dropped");
  }

  void turn_pieces(const std::vector<uint8_t>& is_to_turn) {
    for (size_t i = 0; i < triangles_.size(); ++i) {
      if (is_to_turn[piece_[i]]) std::swap(triangles_[i][1], triangles_[i][2]);
    }
  }

  // Rings of open edges, each vertex with the next, the way that triangles in them would run.
  std::vector<std::vector<uint32_t>> borders() {
    std::map<uint32_t, std::vector<uint32_t>> next;  // undirected: patches may be turned
    for (const Side& side : open_sides()) {
      const uint32_t a = triangles_[side.triangle][side.corner];
      const uint32_t b = triangles_[side.triangle][(side.corner + 1) % 3];
      next[a].push_back(b);
      next[b].push_back(a);
    }
    std::vector<std::vector<uint32_t>> rings;
    std::set<uint32_t> seen;
    for (const auto& [start, ends] : next) {
      if (seen.contains(start)) continue;
      std::vector<uint32_t> ring = {start};
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

  void close_holes(Repair& repair) {
    own_ = triangles_.size();
    size_t closed = 0;
    const std::vector<double> piece_size = diagonals_of_pieces();
    for (const std::vector<uint32_t>& ring : borders()) {
      Bounds box;
      for (const uint32_t vertex : ring) box.extend(vertices_[vertex]);
      const double across = box.diagonal().norm();
      const bool is_small = across <= kSmallHole * diagonal_ &&
                            across <= kPartOfPiece * piece_size[piece_of_vertex_[ring[0]]];
      if (!is_small) {
        repair.largest_opening_m = std::max(repair.largest_opening_m, across);
        continue;
      }
      repair.largest_hole_m = std::max(repair.largest_hole_m, across);
      fill(ring);
      ++closed;
    }
    if (closed > 0) {
      char across[32];
      std::snprintf(across, sizeof across, "%.3g", repair.largest_hole_m);
      done_.push_back(counted(closed, "hole") + " closed, the largest " + across + " m across");
    }
  }

  // Diagonals of connected pieces of surface; piece_of_vertex_ has the piece of each vertex.
  std::vector<double> diagonals_of_pieces() {
    std::vector<uint32_t> parent(vertices_.size());
    std::iota(parent.begin(), parent.end(), 0u);
    const auto root = [&](uint32_t vertex) {
      while (parent[vertex] != vertex) vertex = parent[vertex] = parent[parent[vertex]];
      return vertex;
    };
    for (const auto& [a, b, c] : triangles_) {
      parent[root(b)] = root(a);
      parent[root(c)] = root(a);
    }
    piece_of_vertex_.resize(vertices_.size());
    std::vector<Bounds> boxes(vertices_.size());
    for (uint32_t v = 0; v < vertices_.size(); ++v) {
      piece_of_vertex_[v] = root(v);
      boxes[root(v)].extend(vertices_[v]);
    }
    std::vector<double> sizes(vertices_.size(), 0);
    for (size_t v = 0; v < sizes.size(); ++v) {
      if (!boxes[v].isEmpty()) sizes[v] = boxes[v].diagonal().norm();
    }
    return sizes;
  }

  // By the triangulation of least area (Barequet and Sharir 1995); they are turned later.
  void fill(const std::vector<uint32_t>& ring) {
    const size_t n = ring.size();
    if (n > kMostForLeastArea) {
      Vec3 centre = Vec3::Zero();
      for (const uint32_t vertex : ring) centre += vertices_[vertex] / static_cast<double>(n);
      const auto hub = static_cast<uint32_t>(vertices_.size());
      vertices_.push_back(centre);
      for (size_t i = 0; i < n; ++i) triangles_.push_back({ring[i], ring[(i + 1) % n], hub});
      return;
    }
    const auto area = [&](size_t i, size_t j, size_t k) {
      const Vec3& a = vertices_[ring[i]];
      return (vertices_[ring[j]] - a).cross(vertices_[ring[k]] - a).norm();
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
      triangles_.push_back({ring[i], ring[j], ring[k]});
      open.emplace_back(i, j);
      open.emplace_back(j, k);
    }
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

  std::vector<Vec3> vertices_;
  std::vector<Triangle> triangles_;
  std::vector<std::string> done_;
  Bounds used_;
  double diagonal_ = 0;
  std::vector<uint32_t> piece_;  // per triangle
  uint32_t pieces_ = 0;
  std::vector<uint32_t> piece_of_vertex_;
  size_t own_ = 0;  // triangles before holes were closed
};

}  // namespace

Repair repair_mesh(const TriangleMesh& mesh) { return MeshRepair(mesh).run(mesh); }

}  // namespace pilesim
