#include "pile/guide/cell_grid.h"

#include <algorithm>
#include <cmath>

#include "core/parallel_for.h"
#include "geometry/inside_test.h"
#include "geometry/triangle_tree.h"

namespace pilesim {
namespace {

using Corner = std::array<size_t, 3>;

// Classifies blocks of cells that the surface does not cross as a whole.
class Filler {
 public:
  Filler(const CellGrid& grid, const TriangleMesh& mesh, double from_wall_m,
         std::vector<uint8_t>& cells)
      : grid_(grid), from_wall_m_(from_wall_m), inside_(mesh), surface_(mesh), cells_(cells) {}

  void fill(const Corner& first, const Corner& end) const {
    Vec3 middle, half;
    for (size_t k = 0; k < 3; ++k) {
      const auto e = static_cast<Eigen::Index>(k);
      middle[e] = grid_.low[e] + grid_.cell_m * static_cast<double>(first[k] + end[k]) / 2;
      half[e] = grid_.cell_m * static_cast<double>(end[k] - first[k] - 1) / 2;
    }
    const double reach_m = half.norm(), distance_m = surface_.distance(middle);
    if (distance_m > reach_m || reach_m == 0) {
      const bool is_in = inside_.contains(middle);
      if (!is_in || distance_m >= reach_m + from_wall_m_) {
        if (is_in) set(first, end);
        return;
      }
      if (reach_m == 0) return;
    }
    split(first, end);
  }

 private:
  void split(const Corner& first, const Corner& end) const {
    Corner low = first, high = end;
    size_t longest = 0;
    for (const size_t k : {1U, 2U}) {
      if (end[k] - first[k] > end[longest] - first[longest]) longest = k;
    }
    low[longest] = high[longest] = (first[longest] + end[longest]) / 2;
    fill(first, high);
    fill(low, end);
  }

  void set(const Corner& first, const Corner& end) const {
    for (size_t z = first[2]; z < end[2]; ++z) {
      for (size_t y = first[1]; y < end[1]; ++y) {
        const size_t row = grid_.count[0] * (y + grid_.count[1] * z);
        std::fill_n(cells_.begin() + static_cast<std::ptrdiff_t>(row + first[0]), end[0] - first[0],
                    uint8_t{1});
      }
    }
  }

  const CellGrid& grid_;
  double from_wall_m_;
  InsideTest inside_;
  TriangleTree surface_;
  std::vector<uint8_t>& cells_;
};

}  // namespace

CellGrid::CellGrid(const Bounds& box, double wanted_m, double most_cells)
    : low(box.min()), cell_m(std::max(wanted_m, std::cbrt(box.volume() / most_cells))) {
  for (size_t k = 0; k < 3; ++k) {
    const double size_m = box.sizes()[static_cast<Eigen::Index>(k)];
    count[k] = static_cast<size_t>(std::ceil(size_m / cell_m)) + 1;
  }
}

Vec3 CellGrid::middle_of(size_t cell) const {
  return low + cell_m * (Vec3::Constant(0.5) + corner_of(cell));
}

Vec3 CellGrid::corner_of(size_t cell) const {
  const size_t layer = cell / (count[0] * count[1]);
  return Vec3(static_cast<double>(cell % count[0]), static_cast<double>(cell / count[0] % count[1]),
              static_cast<double>(layer));
}

size_t CellGrid::cell_of(const Vec3& point) const {
  const Vec3 place = (point - low) / cell_m;
  std::array<size_t, 3> at{};
  for (size_t k = 0; k < 3; ++k) {
    const double along = place[static_cast<Eigen::Index>(k)];
    if (!(along >= 0) || along >= static_cast<double>(count[k])) return size();
    at[k] = static_cast<size_t>(along);
  }
  return at[0] + count[0] * (at[1] + count[1] * at[2]);
}

std::vector<uint8_t> CellGrid::inside(const TriangleMesh& mesh, double from_wall_m) const {
  std::vector<uint8_t> cells(size(), 0);
  const Filler filler(*this, mesh, from_wall_m, cells);
  // The block size does not depend on the number of threads.
  constexpr size_t kBlock = 16;
  Corner blocks{};
  for (size_t k = 0; k < 3; ++k) blocks[k] = (count[k] + kBlock - 1) / kBlock;
  parallel_for(blocks[0] * blocks[1] * blocks[2], 1, [&](size_t begin, size_t end) {
    for (size_t block = begin; block < end; ++block) {
      const Corner at = {block % blocks[0], block / blocks[0] % blocks[1],
                         block / (blocks[0] * blocks[1])};
      Corner first{}, last{};
      for (size_t k = 0; k < 3; ++k) {
        first[k] = at[k] * kBlock;
        last[k] = std::min(count[k], first[k] + kBlock);
      }
      filler.fill(first, last);
    }
  });
  return cells;
}

}  // namespace pilesim
