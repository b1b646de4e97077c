// Pictures that surfaces show in place of a colour, and where on them.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/colour.h"

namespace pilesim {

inline constexpr int kLargestTexture = 2048;  // pixels a side; larger ones are shrunk on import

// Rows from top to bottom, no padding.
struct Texture {
  int width = 0, height = 0;   // pixels, [1, kLargestTexture] where it is kept
  std::vector<Colour> pixels;  // (height, width)
  bool operator==(const Texture&) const = default;
};

// The same picture of `width` x `height` pixels, at least one and no more than it has: each is the
// mean of the light of the pixels that it covers.
Texture shrunk(const Texture& texture, int width, int height);

// Where a triangle's corners lie in a texture: to the right and downward, 1 is all of its width or
// height. Beyond [0, 1] it repeats. Finite.
using TextureCorners = std::array<std::array<float, 2>, 3>;

// The textures of a mesh. They are shared by all that show them.
struct TextureMap {
  std::vector<std::shared_ptr<const Texture>> textures;
  // (T), or none where no triangle has one.
  std::vector<uint32_t> texture;  // 1 + index into textures, 0: none, the triangle has its colour
  std::vector<TextureCorners> corners;

  bool empty() const { return texture.empty(); }
  // One triangle more, which lies as triangle `index` of `other` does.
  void add(const TextureMap& other, size_t index) {
    texture.push_back(other.texture[index]);
    corners.push_back(other.corners[index]);
  }
};

// Whether `map` may belong to a mesh of `triangles` triangles: lengths, indices and places.
bool is_sound(const TextureMap& map, size_t triangles);

}  // namespace pilesim
