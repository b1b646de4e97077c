#include "simulate/sphere/sphere_grid.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/parallel_for.h"

namespace pilesim {
namespace {

// Most cells per sphere: spheres far out share the outermost cells.
constexpr size_t kCellsPerSphere = 8;
constexpr size_t kFewestCells = 4096;
// The median of this many evenly spaced samples is accurate enough.
constexpr size_t kSamples = 1000;
constexpr size_t kSpheresPerTask = 2048, kBlocksPerTask = 4;

template <class Value>
float sampled_median(size_t count, const Value& value) {
  const size_t stride = count / kSamples + 1;
  std::vector<float> samples;
  for (size_t i = 0; i < count; i += stride) samples.push_back(value(i));
  const auto middle = samples.begin() + static_cast<ptrdiff_t>(samples.size() / 2);
  std::nth_element(samples.begin(), middle, samples.end());
  return *middle;
}

}  // namespace

void SphereGrid::choose_box(std::span<const Vec3f> centres) {
  Eigen::AlignedBox3f box;
  for (const uint32_t i : small_indices_) box.extend(centres[i]);
  if (small_indices_.empty()) box.extend(Vec3f::Zero().eval());
  const size_t most = kFewestCells + kCellsPerSphere * small_indices_.size();
  const auto cells_along = [&](Eigen::Index axis) {
    return std::floor(box.sizes()(axis) * inverse_cell_) + 1;
  };
  while (static_cast<double>(cells_along(0)) * cells_along(1) * cells_along(2) >
         static_cast<double>(most)) {
    Eigen::Index axis = 0;
    box.sizes().maxCoeff(&axis);
    // Most spheres are around here, even if some have flown away.
    const float middle = sampled_median(small_indices_.size(),
                                        [&](size_t i) { return centres[small_indices_[i]](axis); });
    const float half = box.sizes()(axis) / 4;
    box.min()(axis) = std::max(box.min()(axis), middle - half);
    box.max()(axis) = std::min(box.max()(axis), middle + half);
  }
  origin_ = box.min();
  for (size_t i = 0; i < 3; ++i) {
    const auto axis = static_cast<Eigen::Index>(i);
    blocks_[i] = (static_cast<size_t>(cells_along(axis)) + kBlock - 1) / kBlock;
    cells_[i] = static_cast<int>(blocks_[i]) * kBlock;
  }
}

std::array<int, 3> SphereGrid::cell_of(const Vec3f& point) const {
  std::array<int, 3> cell;
  for (size_t i = 0; i < 3; ++i) {
    const auto axis = static_cast<Eigen::Index>(i);
    const float at = (point(axis) - origin_(axis)) * inverse_cell_;
    cell[i] = static_cast<int>(std::clamp(at, 0.0F, static_cast<float>(cells_[i] - 1)));
  }
  return cell;
}

std::array<int, 3> SphereGrid::corner_of(size_t box_block) const {
  const auto x = static_cast<int>(box_block % blocks_[0]);
  const auto y = static_cast<int>(box_block / blocks_[0] % blocks_[1]);
  const auto z = static_cast<int>(box_block / blocks_[0] / blocks_[1]);
  return {x * kBlock, y * kBlock, z * kBlock};
}

size_t SphereGrid::neighbours(uint32_t key, std::array<Range, kMostRanges>& ranges) const {
  const int cell = key % kCellsOfBlock;
  const int x = cell % kBlock, y = cell / kBlock % kBlock, z = cell / (kBlock * kBlock);
  const auto inside = [](int i) { return i > 0 && i < kBlock - 1; };
  if (inside(x) && inside(y) && z < kBlock - 1) {
    constexpr uint32_t kRow = kBlock, kLayer = kBlock * kBlock;
    ranges[0] = {start_[key], start_[key + 2]};
    size_t i = 1;
    for (const uint32_t middle :
         {key + kRow, key + kLayer - kRow, key + kLayer, key + kLayer + kRow}) {
      ranges[i++] = {start_[middle - 1], start_[middle + 2]};
    }
    return i;
  }
  const std::array<int, 3> corner = corner_of(block_of_[key / kCellsOfBlock]);
  return neighbours_across(corner[0] + x, corner[1] + y, corner[2] + z, ranges);
}

size_t SphereGrid::neighbours_across(int x, int y, int z,
                                     std::array<Range, kMostRanges>& ranges) const {
  size_t count = 0;
  const auto add = [&](const Range& range) { ranges[count++] = range; };
  const int from = std::max(x - 1, 0), to = std::min(x + 1, cells_[0] - 1);
  for_each_of_row(x, to, y, z, add);
  if (y + 1 < cells_[1]) for_each_of_row(from, to, y + 1, z, add);
  if (z + 1 < cells_[2]) {
    for (int cy = std::max(y - 1, 0); cy <= std::min(y + 1, cells_[1] - 1); ++cy) {
      for_each_of_row(from, to, cy, z + 1, add);
    }
  }
  return count;
}

void SphereGrid::sort(std::span<const Vec3f> centres, std::span<const float> radii) {
  small_indices_.clear();
  large_indices_.clear();
  const float limit = radii.empty() ? 0 : kLargeRatio * sampled_median(radii.size(), [&](size_t i) {
                                            return radii[i];
                                          });
  widest_m_ = 0;
  for (uint32_t i = 0; i < radii.size(); ++i) {
    if (radii[i] <= limit) {
      small_indices_.push_back(i);
      widest_m_ = std::max(widest_m_, radii[i]);
    } else {
      large_indices_.push_back(i);
    }
  }
  cell_m_ = widest_m_ > 0 ? 2 * widest_m_ : 1;
  inverse_cell_ = 1 / cell_m_;
  choose_box(centres);
  small_ = small_indices_.size();
  keys_.resize(radii.size());
  cell_.resize(radii.size());
  parallel_for(small_, kSpheresPerTask, [&](size_t begin, size_t end) {
    for (size_t k = begin; k < end; ++k) {
      const uint32_t i = small_indices_[k];
      const auto [x, y, z] = cell_of(centres[i]);
      keys_[i] = static_cast<uint32_t>(box_block(x, y, z));
      cell_[i] = static_cast<uint16_t>(cell_in_block(x, y, z));
    }
  });
  sort_by_block();
  std::ranges::copy(large_indices_, order_.begin() + static_cast<ptrdiff_t>(small_));
}

void SphereGrid::sort_by_block() {
  const size_t total = blocks_[0] * blocks_[1] * blocks_[2];
  slot_.assign(total, 0);
  for (const uint32_t i : small_indices_) ++slot_[keys_[i]];
  for (std::vector<uint32_t>& blocks : coloured_) blocks.clear();
  block_of_.assign(1, 0);
  next_.assign(1, 0);
  uint32_t place = 0;
  for (uint32_t block = 0; block < total; ++block) {
    if (slot_[block] == 0) continue;
    next_.push_back(place);
    place += slot_[block];
    slot_[block] = static_cast<uint32_t>(block_of_.size());
    block_of_.push_back(block);
    const std::array<int, 3> corner = corner_of(block);
    const auto odd = [&](size_t axis) { return static_cast<size_t>(corner[axis] / kBlock % 2); };
    coloured_[odd(0) + 2 * odd(1) + 4 * odd(2)].push_back(slot_[block] - 1);
  }
  order_.resize(keys_.size());
  by_block_.resize(small_);
  for (const uint32_t i : small_indices_) by_block_[next_[slot_[keys_[i]]]++] = i;
  start_.resize((block_of_.size()) * kCellsOfBlock + 1);
  std::fill_n(start_.begin(), kCellsOfBlock, 0);
  start_.back() = place;
  parallel_for(block_of_.size() - 1, kBlocksPerTask, [&](size_t begin, size_t end) {
    for (size_t block = begin; block < end; ++block) sort_block(block + 1);
  });
}

// Afterwards next_[slot] is the end of its places, as before.
void SphereGrid::sort_block(size_t slot) {
  const uint32_t begin = slot > 1 ? next_[slot - 1] : 0, end = next_[slot];
  std::array<uint32_t, kCellsOfBlock> next{};
  for (uint32_t p = begin; p < end; ++p) ++next[cell_[by_block_[p]]];
  const size_t first_key = slot * kCellsOfBlock;
  uint32_t place = begin;
  for (size_t cell = 0; cell < kCellsOfBlock; ++cell) {
    start_[first_key + cell] = place;
    place += std::exchange(next[cell], place);
  }
  for (uint32_t p = begin; p < end; ++p) {
    const uint32_t i = by_block_[p];
    keys_[i] = static_cast<uint32_t>(first_key + cell_[i]);
    order_[next[cell_[i]]++] = i;
  }
}

}  // namespace pilesim
