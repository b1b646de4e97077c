#include "simulate/sphere_grid.h"

#include <algorithm>
#include <cmath>

namespace pilesim {
namespace {

// At most so many cells a sphere: what lies far out shares the outermost ones.
constexpr size_t kCellsPerSphere = 8;
constexpr size_t kFewestCells = 4096;

}  // namespace

void SphereGrid::choose_box(std::span<const Vec3f> centres) {
  Eigen::AlignedBox3f box;
  Vec3 sum = Vec3::Zero();
  for (const uint32_t i : small_indices_) {
    box.extend(centres[i]);
    sum += centres[i].cast<double>();
  }
  if (small_indices_.empty()) box.extend(Vec3f(Vec3f::Zero()));
  const Vec3f middle =
      (sum / static_cast<double>(std::max<size_t>(1, small_indices_.size()))).cast<float>();
  const size_t most = kFewestCells + kCellsPerSphere * small_indices_.size();
  const auto cells_along = [&](Eigen::Index axis) {
    return std::floor(box.sizes()(axis) * inverse_cell_) + 1;
  };
  while (static_cast<double>(cells_along(0)) * cells_along(1) * cells_along(2) >
         static_cast<double>(most)) {
    Eigen::Index axis = 0;
    box.sizes().maxCoeff(&axis);
    const float half = box.sizes()(axis) / 4;
    box.min()(axis) = std::max(box.min()(axis), middle(axis) - half);
    box.max()(axis) = std::min(box.max()(axis), middle(axis) + half);
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

// Half of the cells around, so that each pair of cells is met once.
size_t SphereGrid::neighbours(int x, int y, int z, std::array<Range, 13>& around) const {
  size_t count = 0;
  for (int dz = 0; dz <= 1; ++dz) {
    for (int dy = dz == 0 ? 0 : -1; dy <= 1; ++dy) {
      for (int dx = dz == 0 && dy == 0 ? 1 : -1; dx <= 1; ++dx) {
        const int cx = x + dx, cy = y + dy, cz = z + dz;
        if (cx < 0 || cy < 0 || cx >= cells_[0] || cy >= cells_[1] || cz >= cells_[2]) continue;
        const Range range = range_of(cx, cy, cz);
        if (range.begin < range.end) around[count++] = range;
      }
    }
  }
  return count;
}

void SphereGrid::sort(std::span<const Vec3f> centres, std::span<const float> radii) {
  small_indices_.clear();
  large_indices_.clear();
  std::vector<float> sorted(radii.begin(), radii.end());
  float limit = 0;
  if (!sorted.empty()) {
    const auto middle = sorted.begin() + static_cast<ptrdiff_t>(sorted.size() / 2);
    std::nth_element(sorted.begin(), middle, sorted.end());
    limit = kLargeRatio * *middle;
  }
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
  std::vector<uint32_t> next(start_.begin(), start_.end() - 1);
  for (const uint32_t i : small_indices_) order_[next[keys_[i]]++] = i;
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
