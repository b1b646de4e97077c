// The sides of a mesh's triangles, ordered by the edges that they lie on.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "geometry/mesh.h"

namespace pilesim {

// One side of one triangle.
struct HalfEdge {
  uint32_t low, high;  // vertex indices, low <= high
  uint32_t triangle;
  uint8_t corner;  // 0 to 2: the side runs from here to the next corner
  bool forward;    // it runs from low to high
};

class HalfEdges {
 public:
  // In time and memory proportional to the triangles. Indices of vertices are below `vertices`.
  HalfEdges(std::span<const Triangle> triangles, size_t vertices);

  // By low, high, triangle and corner, ascending.
  const std::vector<HalfEdge>& all() const { return sides_; }

  // The sides along the edge between two vertices, in any order of these; empty: there is no edge.
  std::span<const HalfEdge> along(uint32_t a, uint32_t b) const {
    const auto [low, high] = std::minmax(a, b);
    const auto begin = sides_.begin() + first_[low], end = sides_.begin() + first_[low + 1];
    const auto found = std::ranges::equal_range(begin, end, high, {}, &HalfEdge::high);
    return {found.begin(), found.end()};
  }

  // visit(span of sides) for each edge, in the order of all().
  template <typename Visit>
  void for_each_edge(const Visit& visit) const {
    for (auto first = sides_.begin(); first != sides_.end();) {
      auto last = first + 1;
      while (last != sides_.end() && last->low == first->low && last->high == first->high) ++last;
      visit(std::span<const HalfEdge>(first, last));
      first = last;
    }
  }

 private:
  std::vector<HalfEdge> sides_;
  std::vector<uint32_t> first_;  // (vertices + 1) of sides_, by low
};

}  // namespace pilesim
