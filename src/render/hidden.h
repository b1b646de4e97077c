// Bodies that are certainly hidden need not be drawn: those that lie behind everything that the
// depths of those in front, drawn before, hold. The picture stays the same, whatever is guessed to
// be in front.
#pragma once

#include <cstdint>
#include <vector>

#include "render/draw_list.h"

namespace pilesim {

// Edge of the blocks that FarthestDepths holds, pixels.
inline constexpr int kDepthBlock = 2;
constexpr int depth_blocks(int pixels) { return (pixels + kDepthBlock - 1) / kDepthBlock; }

// The mark of an instance of a list: certainly hidden, or not looked at; in front; what else may be
// seen.
enum SeenMark : uint8_t { kHidden, kFront, kRest };

// The farthest depth of each block of a target, by rows from the bottom; 1: as far as can be.
struct FarthestDepths {
  int columns = 0, rows = 0;  // of blocks
  std::vector<float> depth;   // (rows * columns)

  // For a target of that size, pixels.
  void resize(int width, int height);
  bool hide(const Footprint& footprint) const;
};

// Marks as kFront bodies that are likely in front of a target of that size, and those much larger
// than `typical_radius_m`, as walls are.
void mark_front(const DrawList& list, int width, int height, float typical_radius_m,
                std::vector<uint8_t>& marks);

// Marks as kRest those that are neither in front nor hidden.
void mark_rest(const DrawList& list, const FarthestDepths& depths, std::vector<uint8_t>& marks);

// Those of `list` with that mark.
void pick(const DrawList& list, const std::vector<uint8_t>& marks, SeenMark mark, DrawList& picked);

}  // namespace pilesim
