// Spheres sorted into the cells of a uniform grid, and the grid's cells into blocks that threads
// can work on side by side.
//
// Cells are as wide as the widest of the small spheres, so that those meet only in neighbouring
// cells. Spheres more than kLargeRatio times as wide as most are apart: they look into all cells
// that they reach. Spheres outside the grid's box count as within its outermost cells.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/types.h"

namespace pilesim {

class SphereGrid {
 public:
  // `radii` include what spheres may come closer in a step. Places 0 .. n - 1 are the spheres in
  // the order of blocks, cells and indices; large ones are last.
  void sort(std::span<const Vec3f> centres, std::span<const float> radii);

  std::span<const uint32_t> order() const { return order_; }  // place -> index
  size_t small_count() const { return small_; }               // places from there on are large

  // Blocks with spheres in them, each of kBlock^3 cells. Blocks of one colour have no neighbouring
  // cells.
  static constexpr int kBlock = 4;
  static constexpr size_t kColours = 8;
  std::span<const uint32_t> blocks(size_t colour) const { return coloured_[colour]; }
  size_t block_count() const { return block_total_; }

  // Calls visit(p, q) for the places of pairs whose cells meet, p of the block: each pair of small
  // spheres once over all blocks.
  template <class Visit>
  void for_each_pair(uint32_t block, const Visit& visit) const {
    const std::array<int, 3> corner = block_corner(block);
    for (int z = corner[2]; z < corner[2] + kBlock; ++z) {
      for (int y = corner[1]; y < corner[1] + kBlock; ++y) {
        for (int x = corner[0]; x < corner[0] + kBlock; ++x) {
          const Range here = range_of(x, y, z);
          if (here.begin == here.end) continue;
          std::array<Range, 13> around;
          const size_t count = neighbours(x, y, z, around);
          for (uint32_t p = here.begin; p < here.end; ++p) {
            for (uint32_t q = p + 1; q < here.end; ++q) visit(p, q);
            for (size_t i = 0; i < count; ++i) {
              for (uint32_t q = around[i].begin; q < around[i].end; ++q) visit(p, q);
            }
          }
        }
      }
    }
  }

  // Calls visit(q) for the places of small spheres in the cells that the box meets.
  template <class Visit>
  void for_each_in(const Vec3f& low, const Vec3f& high, const Visit& visit) const {
    const std::array<int, 3> from = cell_of(low), to = cell_of(high);
    for (int z = from[2]; z <= to[2]; ++z) {
      for (int y = from[1]; y <= to[1]; ++y) {
        for (int x = from[0]; x <= to[0]; ++x) {
          const Range range = range_of(x, y, z);
          for (uint32_t q = range.begin; q < range.end; ++q) visit(q);
        }
      }
    }
  }

  // The places of the spheres of a block.
  struct Range {
    uint32_t begin, end;
  };
  Range places(uint32_t block) const {
    return {start_[size_t{block} * kCellsOfBlock], start_[(size_t{block} + 1) * kCellsOfBlock]};
  }

 private:
  static constexpr size_t kCellsOfBlock = kBlock * kBlock * kBlock;
  static constexpr float kLargeRatio = 1.6F;

  void choose_box(std::span<const Vec3f> centres);
  std::array<int, 3> cell_of(const Vec3f& point) const;
  size_t key_of(int x, int y, int z) const {
    const size_t block =
        (static_cast<size_t>(z / kBlock) * blocks_[1] + static_cast<size_t>(y / kBlock)) *
            blocks_[0] +
        static_cast<size_t>(x / kBlock);
    const auto cell =
        static_cast<size_t>(((z % kBlock) * kBlock + y % kBlock) * kBlock + x % kBlock);
    return block * kCellsOfBlock + cell;
  }
  Range range_of(int x, int y, int z) const {
    const size_t key = key_of(x, y, z);
    return {start_[key], start_[key + 1]};
  }
  std::array<int, 3> block_corner(uint32_t block) const;
  size_t neighbours(int x, int y, int z, std::array<Range, 13>& around) const;

  Vec3f origin_ = Vec3f::Zero();
  float cell_m_ = 1, inverse_cell_ = 1;
  std::array<int, 3> cells_{};  // a multiple of kBlock along each axis
  std::array<size_t, 3> blocks_{};
  size_t small_ = 0, block_total_ = 0;
  std::vector<uint32_t> start_;  // by key: the first place
  std::vector<uint32_t> keys_;   // by index
  std::vector<uint32_t> order_;
  std::vector<uint32_t> small_indices_, large_indices_;
  std::array<std::vector<uint32_t>, kColours> coloured_;
};

}  // namespace pilesim
