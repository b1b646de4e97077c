#include "render/hidden.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace pilesim {
namespace {

// In front is what lies no more than so many radii behind the nearest in a block that it covers:
// through the gaps between the nearest those behind them are seen.
constexpr float kFrontRadii = 4;
// A body larger than this many typical radii may be hollow or flat: a crate's middle does not tell
// where it is seen.
constexpr float kLarge = 3;
// Side of the rectangle that a body certainly covers, as a share of its sphere's.
constexpr float kCovered = 0.5f;

struct Blocks {
  int left, right, bottom, top;  // to the one before
};

// Those that a rectangle of pixels touches.
Blocks blocks_of(float left, float right, float bottom, float top, int columns, int rows) {
  const auto block = [](float pixel, int most) {
    return static_cast<int>(
        std::clamp(std::floor(pixel / kDepthBlock), -1.0f, static_cast<float>(most)));
  };
  return {std::max(0, block(left, columns)), std::min(columns, block(right, columns) + 1),
          std::max(0, block(bottom, rows)), std::min(rows, block(top, rows) + 1)};
}

}  // namespace

void FarthestDepths::resize(int width, int height) {
  columns = depth_blocks(width);
  rows = depth_blocks(height);
  depth.resize(static_cast<size_t>(columns) * static_cast<size_t>(rows));
}

bool FarthestDepths::hide(const Footprint& footprint) const {
  const Blocks covered =
      blocks_of(footprint.left, footprint.right, footprint.bottom, footprint.top, columns, rows);
  for (int row = covered.bottom; row < covered.top; ++row) {
    const float* const line = depth.data() + static_cast<ptrdiff_t>(row) * columns;
    for (int column = covered.left; column < covered.right; ++column) {
      if (line[column] >= footprint.nearest) return false;
    }
  }
  return true;
}

void mark_front(const DrawList& list, int width, int height, float typical_radius_m,
                std::vector<uint8_t>& marks) {
  const int columns = depth_blocks(width), rows = depth_blocks(height);
  std::vector<float> nearest_m(static_cast<size_t>(columns) * static_cast<size_t>(rows),
                               std::numeric_limits<float>::max());
  const auto for_each_block = [&](const Footprint& of, const auto& visit) {
    const float x = (of.left + of.right) / 2, y = (of.bottom + of.top) / 2;
    const float half_x = kCovered * (of.right - of.left) / 2;
    const float half_y = kCovered * (of.top - of.bottom) / 2;
    const Blocks covered = blocks_of(x - half_x, x + half_x, y - half_y, y + half_y, columns, rows);
    for (int row = covered.bottom; row < covered.top; ++row) {
      for (int column = covered.left; column < covered.right; ++column) {
        visit(nearest_m[static_cast<size_t>(row) * static_cast<size_t>(columns) +
                        static_cast<size_t>(column)]);
      }
    }
  };
  const auto counts = [&](const Footprint& of) {
    return of.nearest > 0 && of.radius_m <= kLarge * typical_radius_m;
  };
  for (const Footprint& of : list.footprints) {
    if (!counts(of)) continue;
    for_each_block(of, [&](float& nearest) { nearest = std::min(nearest, of.away_m); });
  }
  marks.assign(list.footprints.size(), kHidden);
  for (size_t i = 0; i < marks.size(); ++i) {
    const Footprint& of = list.footprints[i];
    if (!counts(of)) {
      marks[i] = kFront;
      continue;
    }
    for_each_block(of, [&](float nearest) {
      if (of.away_m <= nearest + kFrontRadii * of.radius_m) marks[i] = kFront;
    });
  }
}

void mark_rest(const DrawList& list, const FarthestDepths& depths, std::vector<uint8_t>& marks) {
  for (size_t i = 0; i < marks.size(); ++i) {
    if (marks[i] == kHidden && !depths.hide(list.footprints[i])) marks[i] = kRest;
  }
}

void pick(const DrawList& list, const std::vector<uint8_t>& marks, SeenMark mark,
          DrawList& picked) {
  picked.instances.clear();
  picked.batches.clear();
  for (const DrawBatch& batch : list.batches) {
    const auto first = static_cast<uint32_t>(picked.instances.size());
    for (uint32_t i = 0; i < batch.instance_count; ++i) {
      const uint32_t at = batch.first_instance + i;
      if (marks[at] == mark) picked.instances.push_back(list.instances[at]);
    }
    const uint32_t count = static_cast<uint32_t>(picked.instances.size()) - first;
    if (count > 0) picked.batches.push_back({batch.shape, batch.level, first, count});
  }
}

}  // namespace pilesim
