// Sorts spheres into the cells of a uniform grid, and the cells into blocks for parallel work.
//
// Cells are as wide as the largest small sphere, so that small spheres touch only in neighbouring
// cells. Spheres more than kLargeRatio times as wide as most are separate: they test all cells
// within their reach. Spheres outside the grid's box count as in its outermost cells.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/types.h"

namespace pilesim {

class SphereGrid {
 public:
  // `radii` include the possible approach within a step. Places 0 .. n - 1 are the spheres ordered
  // by block, cell and index; large ones are last.
  void sort(std::span<const Vec3f> centres, std::span<const float> radii);

  std::span<const uint32_t> order() const { return order_; }  // place -> index
  size_t small_count() const { return small_; }               // places from here on are large

  float widest_m() const { return widest_m_; }  // largest radius of the small ones

  // Non-empty blocks, each of kBlock^3 cells, are numbered in the order of their places. Blocks of
  // one colour have no neighbouring cells.
  static constexpr int kBlock = 8;
  static constexpr size_t kColours = 8;
  std::span<const uint32_t> blocks(size_t colour) const { return coloured_[colour]; }

  struct Range {
    uint32_t begin, end;
  };

  // Calls visit(p, ranges) for each place p of the block. The ranges contain the places in cells
  // next to p's, such that all blocks together visit each pair of small spheres once.
  template <class Visit>
  void for_each_place(uint32_t block, const Visit& visit) const {
    std::array<Range, kMostRanges> ranges;
    const Range all = places(block);
    for (uint32_t first = all.begin; first < all.end;) {
      const uint32_t key = keys_[order_[first]];
      const uint32_t end = start_[size_t{key} + 1];
      const size_t count = neighbours(key, ranges);
      for (uint32_t p = first; p < end; ++p) {
        ranges[0].begin = p + 1;
        visit(p, std::span<const Range>(ranges.data(), count));
      }
      first = end;
    }
  }

  // Calls visit(p, q) for the places of those pairs.
  template <class Visit>
  void for_each_pair(uint32_t block, const Visit& visit) const {
    for_each_place(block, [&](uint32_t p, std::span<const Range> ranges) {
      for (const Range& range : ranges) {
        for (uint32_t q = range.begin; q < range.end; ++q) visit(p, q);
      }
    });
  }

  // Calls visit(range) for the places of small spheres in cells that intersect the box.
  template <class Visit>
  void for_each_range_in(const Vec3f& low, const Vec3f& high, const Visit& visit) const {
    const std::array<int, 3> from = cell_of(low), to = cell_of(high);
    for (int z = from[2]; z <= to[2]; ++z) {
      for (int y = from[1]; y <= to[1]; ++y) for_each_of_row(from[0], to[0], y, z, visit);
    }
  }

  // Calls visit(q) for those places.
  template <class Visit>
  void for_each_in(const Vec3f& low, const Vec3f& high, const Visit& visit) const {
    for_each_range_in(low, high, [&](const Range& range) {
      for (uint32_t q = range.begin; q < range.end; ++q) visit(q);
    });
  }

  // The places of a block's spheres.
  Range places(uint32_t block) const {
    return {start_[(size_t{block} + 1) * kCellsOfBlock],
            start_[(size_t{block} + 2) * kCellsOfBlock]};
  }

 private:
  static constexpr size_t kCellsOfBlock = size_t{kBlock} * kBlock * kBlock;
  static constexpr float kLargeRatio = 1.6F;

  void choose_box(std::span<const Vec3f> centres);
  // Sorts by block, then each block by cell.
  void sort_by_block();
  void sort_block(size_t slot);
  std::array<int, 3> cell_of(const Vec3f& point) const;
  size_t box_block(int x, int y, int z) const {
    return (static_cast<size_t>(z / kBlock) * blocks_[1] + static_cast<size_t>(y / kBlock)) *
               blocks_[0] +
           static_cast<size_t>(x / kBlock);
  }
  static size_t cell_in_block(int x, int y, int z) {
    const int cell = ((z % kBlock) * kBlock + y % kBlock) * kBlock + x % kBlock;
    return static_cast<size_t>(cell);
  }
  size_t key_of(int x, int y, int z) const {
    return slot_[box_block(x, y, z)] * kCellsOfBlock + cell_in_block(x, y, z);
  }
  // Consecutive cells of a row within a block form one range.
  template <class Visit>
  void for_each_of_row(int from, int to, int y, int z, const Visit& visit) const {
    while (from <= to) {
      const int last = std::min(to, (from / kBlock + 1) * kBlock - 1);
      const size_t key = key_of(from, y, z);
      const Range range{start_[key], start_[key + static_cast<size_t>(last - from) + 1]};
      if (range.begin < range.end) visit(range);
      from = last + 1;
    }
  }
  std::array<int, 3> corner_of(size_t box_block) const;
  // The cell with its neighbour in the row, and half of the surrounding rows of three: each is one
  // range or, at the end of a block, two.
  static constexpr size_t kMostRanges = 10;
  size_t neighbours(uint32_t key, std::array<Range, kMostRanges>& ranges) const;
  size_t neighbours_across(int x, int y, int z, std::array<Range, kMostRanges>& ranges) const;

  Vec3f origin_ = Vec3f::Zero();
  float cell_m_ = 1, inverse_cell_ = 1;
  std::array<int, 3> cells_{};  // a multiple of kBlock along each axis
  std::array<size_t, 3> blocks_{};
  float widest_m_ = 0;
  size_t small_ = 0;
  // Slot 0 is for all empty blocks of the box; the others are consecutive.
  std::vector<uint32_t> slot_;      // by block of the box
  std::vector<uint32_t> block_of_;  // by slot: of the box
  std::vector<uint32_t> start_;     // by key = slot and cell: its first place
  std::vector<uint32_t> keys_;      // by index; before the sort by cell: the block, and the cell
  std::vector<uint16_t> cell_;
  std::vector<uint32_t> order_, by_block_;
  std::vector<uint32_t> next_, small_indices_, large_indices_;
  std::array<std::vector<uint32_t>, kColours> coloured_;
};

}  // namespace pilesim
