#include "core/texture.h"

#include <gtest/gtest.h>

#include <limits>

namespace pilesim {
namespace {

constexpr Colour kBlack{0, 0, 0}, kWhite{255, 255, 255};

Texture checker(int width, int height) {
  Texture texture{.width = width, .height = height, .pixels = {}};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) texture.pixels.push_back((x + y) % 2 == 0 ? kWhite : kBlack);
  }
  return texture;
}

TEST(Texture, ShrinksToTheMeanOfLight) {
  // Half of the light is not half of the number.
  const Texture half = shrunk(checker(6, 4), 3, 2);
  EXPECT_EQ(half.width, 3);
  EXPECT_EQ(half.height, 2);
  EXPECT_EQ(half.pixels, std::vector<Colour>(6, Colour{188, 188, 188}));
  // White, black, white as two pixels: each two thirds of an end and a third of the middle.
  const Texture two = shrunk(checker(3, 1), 2, 1);
  const uint8_t two_thirds = srgb_from_linear(2.0 / 3);
  EXPECT_EQ(two.pixels, std::vector<Colour>(2, Colour{two_thirds, two_thirds, two_thirds}));
  EXPECT_EQ(shrunk(checker(5, 7), 5, 7), checker(5, 7));
}

TEST(Texture, EveryValueIsItsOwnNearest) {
  for (int value = 0; value < 256; ++value) {
    const float linear = linear_of_srgb()[static_cast<size_t>(value)];
    EXPECT_EQ(nearest_srgb(linear), value);
    EXPECT_EQ(srgb_from_linear(linear), value);
  }
  EXPECT_EQ(nearest_srgb(-1), 0);
  EXPECT_EQ(nearest_srgb(2), 255);
}

TEST(TextureMap, IsSoundOrNot) {
  EXPECT_TRUE(is_sound({}, 3));
  TextureMap map{.textures = {std::make_shared<const Texture>(checker(2, 2))},
                 .texture = {0, 1},
                 .corners = {{}, {}}};
  EXPECT_TRUE(is_sound(map, 2));
  EXPECT_FALSE(is_sound(map, 3));
  map.texture[0] = 2;
  EXPECT_FALSE(is_sound(map, 2));
  map.texture[0] = 0;
  map.corners[1][2][0] = std::numeric_limits<float>::infinity();
  EXPECT_FALSE(is_sound(map, 2));
  map.corners.clear();
  EXPECT_FALSE(is_sound(map, 2));
}

}  // namespace
}  // namespace pilesim
