// A texture and its halves, for smaller drawings.
#pragma once

#include <memory>
#include <vector>

#include "core/texture.h"
#include "core/types.h"

namespace pilesim {

class MipMap {
 public:
  explicit MipMap(std::shared_ptr<const Texture> texture);

  // From the whole texture to one pixel, each half as wide and high as the one before, rounded
  // down.
  const std::vector<std::shared_ptr<const Texture>>& levels() const { return levels_; }
  const Texture& full() const { return *levels_.front(); }

  // Linear, at a place as TextureCorners have it, of what is `texels` of the whole texture wide
  // there: between the four nearest of the level whose texels are hardly smaller.
  Vec3f at(const Eigen::Vector2f& place, float texels) const;

 private:
  std::vector<std::shared_ptr<const Texture>> levels_;
};

}  // namespace pilesim
