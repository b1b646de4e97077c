#include "render/mip_map.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace pilesim {

MipMap::MipMap(std::shared_ptr<const Texture> texture) {
  levels_.push_back(std::move(texture));
  while (std::max(levels_.back()->width, levels_.back()->height) > 1) {
    const Texture& last = *levels_.back();
    levels_.push_back(std::make_shared<const Texture>(
        shrunk(last, std::max(1, last.width / 2), std::max(1, last.height / 2))));
  }
}

Vec3f MipMap::at(const Eigen::Vector2f& place, float texels) const {
  const auto coarsest = static_cast<int>(levels_.size() - 1);
  const int level = texels < 2 ? 0 : std::min(std::ilogb(texels), coarsest);
  const Texture& texture = *levels_[static_cast<size_t>(level)];
  struct Pair {
    int first, second;
    float share;  // of the second
  };
  const auto neighbours = [](float coordinate, int count) {
    const float at = (coordinate - std::floor(coordinate)) * static_cast<float>(count) - 0.5f;
    const int low = std::min(static_cast<int>(std::floor(at)), count - 1);
    return Pair{low < 0 ? count - 1 : low, low + 1 < count ? low + 1 : 0,
                at - static_cast<float>(low)};
  };
  const Pair column = neighbours(place.x(), texture.width);
  const Pair row = neighbours(place.y(), texture.height);
  const std::array<float, 256>& linear = linear_of_srgb();
  Vec3f sum = Vec3f::Zero();
  const auto add = [&](int x, int y, float weight) {
    const Colour& pixel =
        texture.pixels[static_cast<size_t>(y) * static_cast<size_t>(texture.width) +
                       static_cast<size_t>(x)];
    sum += weight * Vec3f(linear[pixel[0]], linear[pixel[1]], linear[pixel[2]]);
  };
  add(column.first, row.first, (1 - column.share) * (1 - row.share));
  add(column.second, row.first, column.share * (1 - row.share));
  add(column.first, row.second, (1 - column.share) * row.share);
  add(column.second, row.second, column.share * row.share);
  return sum;
}

}  // namespace pilesim
