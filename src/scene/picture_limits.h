// How large a picture may be, and how long it may take.
#pragma once

#include <cstdint>

namespace pilesim {

inline constexpr int kSmallestSide = 16;    // pixels
inline constexpr int kLargestSide = 16384;  // OSMesa draws no larger ones
// Pixels of a picture: drawing takes about 80 bytes a pixel.
inline constexpr int64_t kMostPixels = int64_t{1} << 26;
// By rays: no difference is left in 8 bits long before.
inline constexpr int kMostRaySamples = 1 << 16;  // a pixel
inline constexpr int kMostRayBounces = 4;

}  // namespace pilesim
