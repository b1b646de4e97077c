#include "simulate/sphere_grid.h"

#include <algorithm>
#include <cmath>

namespace pilesim {
namespace {

// At most so many cells a sphere: what lies far out shares the outermost ones.
constexpr size_t kCellsPerSphere = 8;
constexpr size_t kFewestCells = 4096;
// A median of so many samples, evenly taken, is good enough.
constexpr size_t kSamples = 1000;

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
    // Most are around here, wherever some may have flown.
    const float middle = sampled_median(small_indices_.size(),
                                        [&](size_t i) { return centres[small_indices_[i]](axis); });
    const float half = box.sizes()(axis) / 4;
    box.min()(axis) = std::max(box.min()(axis), middle - half);
    box.max()(axis) = std::min(box.max()(axis), middle + half);
  }
  origin_ = box.min();
  block_total_ = 1;
  for (size_t i = 0; i < 3; ++i) {
    const auto axis = static_cast<Eigen::Index>(i);
    blocks_[i] = (static_cast<size_t>(cells_along(axis)) + kBlock - 1) / kBlock;
    cells_[i] = static_cast<int>(blocks_[i]) * kBlock;
    block_total_ *= blocks_[i];
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

std::array<int, 3> SphereGrid::block_corner(uint32_t block) const {
  const auto x = static_cast<int>(block % blocks_[0]);
  const auto y = static_cast<int>(block / blocks_[0] % blocks_[1]);
  const auto z = static_cast<int>(block / blocks_[0] / blocks_[1]);
  return {x * kBlock, y * kBlock, z * kBlock};
}

size_t SphereGrid::neighbours(uint32_t key, std::array<Range, kMostRanges>& ranges) const {
  const std::array<int, 3> corner = block_corner(key / kCellsOfBlock);
  const int cell = key % kCellsOfBlock;
  const int x = corner[0] + cell % kBlock, y = corner[1] + cell / kBlock % kBlock;
  const int z = corner[2] + cell / (kBlock * kBlock);
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
  float widest = 0;
  for (uint32_t i = 0; i < radii.size(); ++i) {
    if (radii[i] <= limit) {
      small_indices_.push_back(i);
      widest = std::max(widest, radii[i]);
    } else {
      large_indices_.push_back(i);
    }
  }
  cell_m_ = widest > 0 ? 2 * widest : 1;
  inverse_cell_ = 1 / cell_m_;
  choose_box(centres);
  small_ = small_indices_.size();

  start_.assign(block_total_ * kCellsOfBlock + 1, 0);
  keys_.resize(radii.size());
  for (const uint32_t i : small_indices_) {
    const std::array<int, 3> cell = cell_of(centres[i]);
    keys_[i] = static_cast<uint32_t>(key_of(cell[0], cell[1], cell[2]));
    ++start_[keys_[i] + 1];
  }
  for (size_t key = 1; key < start_.size(); ++key) start_[key] += start_[key - 1];
  order_.resize(radii.size());
  next_.assign(start_.begin(), start_.end() - 1);
  for (const uint32_t i : small_indices_) order_[next_[keys_[i]]++] = i;
  std::ranges::copy(large_indices_, order_.begin() + static_cast<ptrdiff_t>(small_));

  for (std::vector<uint32_t>& blocks : coloured_) blocks.clear();
  for (uint32_t block = 0; block < block_total_; ++block) {
    const Range range = places(block);
    if (range.begin == range.end) continue;
    const std::array<int, 3> corner = block_corner(block);
    const auto odd = [&](size_t axis) { return static_cast<size_t>(corner[axis] / kBlock % 2); };
    coloured_[odd(0) + 2 * odd(1) + 4 * odd(2)].push_back(block);
  }
}

}  // namespace pilesim
