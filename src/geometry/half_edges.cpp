#include "geometry/half_edges.h"

#include <cassert>
#include <numeric>
#include <tuple>

namespace pilesim {

HalfEdges::HalfEdges(std::span<const Triangle> triangles, size_t vertices)
    : sides_(3 * triangles.size()), first_(vertices + 1, 0) {
  assert(sides_.size() <= UINT32_MAX);
  const auto for_each_side = [&](const auto& visit) {
    for (uint32_t t = 0; t < triangles.size(); ++t) {
      for (uint8_t k = 0; k < 3; ++k) {
        const uint32_t from = triangles[t][k], to = triangles[t][(k + 1U) % 3];
        visit(HalfEdge{std::min(from, to), std::max(from, to), t, k, from < to});
      }
    }
  };
  for_each_side([&](const HalfEdge& side) { ++first_[side.low + 1]; });
  std::partial_sum(first_.begin(), first_.end(), first_.begin());
  std::vector<uint32_t> next(first_.begin(), first_.end() - 1);
  for_each_side([&](const HalfEdge& side) { sides_[next[side.low]++] = side; });
  for (size_t low = 0; low < vertices; ++low) {
    std::ranges::sort(
        sides_.begin() + first_[low], sides_.begin() + first_[low + 1], {},
        [](const HalfEdge& side) { return std::tuple(side.high, side.triangle, side.corner); });
  }
}

}  // namespace pilesim
