// How large a picture may be.
#pragma once

#include <cstdint>

namespace pilesim {

inline constexpr int kSmallestSide = 16;    // pixels
inline constexpr int kLargestSide = 16384;  // what OSMesa draws
// Of a picture: drawing takes about 80 bytes a pixel.
inline constexpr int64_t kMostPixels = int64_t{1} << 26;

}  // namespace pilesim
