#include "core/texture.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace pilesim {
namespace {

using Linear = std::array<float, 3>;

// The places of a row of `from` that place `index` of one of `to` covers, and the share of it that
// each makes up.
template <typename Visit>
void for_covered(int index, int to, int from, const Visit& visit) {
  const double low = static_cast<double>(index) * from / to;
  const double high = static_cast<double>(index + 1) * from / to;
  for (int i = static_cast<int>(low); i < from && i < high; ++i) {
    const double covered = std::min(high, i + 1.0) - std::max(low, static_cast<double>(i));
    visit(i, static_cast<float>(covered / (high - low)));
  }
}

}  // namespace

Texture shrunk(const Texture& texture, int width, int height) {
  assert(width > 0 && height > 0 && width <= texture.width && height <= texture.height);
  const std::array<float, 256>& linear = linear_of_srgb();
  Texture result{.width = width, .height = height, .pixels = {}};
  result.pixels.reserve(static_cast<size_t>(width) * static_cast<size_t>(height));
  std::vector<Linear> sums;
  for (int row = 0; row < height; ++row) {
    sums.assign(static_cast<size_t>(width), Linear{});
    for_covered(row, height, texture.height, [&](int source_row, float share_of_rows) {
      const Colour* source =
          &texture.pixels[static_cast<size_t>(source_row) * static_cast<size_t>(texture.width)];
      for (int column = 0; column < width; ++column) {
        Linear& sum = sums[static_cast<size_t>(column)];
        for_covered(column, width, texture.width, [&](int source_column, float share) {
          for (size_t k = 0; k < 3; ++k) {
            sum[k] += share_of_rows * share * linear[source[source_column][k]];
          }
        });
      }
    });
    for (const Linear& sum : sums) {
      result.pixels.push_back({nearest_srgb(sum[0]), nearest_srgb(sum[1]), nearest_srgb(sum[2])});
    }
  }
  return result;
}

bool is_sound(const TextureMap& map, size_t triangles) {
  if (map.empty()) return map.corners.empty();
  return map.texture.size() == triangles && map.corners.size() == triangles &&
         std::ranges::all_of(map.texture, [&](uint32_t t) { return t <= map.textures.size(); }) &&
         std::ranges::all_of(map.corners, [](const TextureCorners& corners) {
           return std::ranges::all_of(corners, [](const std::array<float, 2>& at) {
             return std::isfinite(at[0]) && std::isfinite(at[1]);
           });
         });
}

}  // namespace pilesim
