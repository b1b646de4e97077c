// Force chains over pictures, from their file.
#include <gtest/gtest.h>

#include "core/error.h"
#include "render/overlay.h"
#include "support/render_fixture.h"
#include "trajectory/guide_file.h"

namespace pilesim {
namespace {

constexpr int kWidth = 320, kHeight = 240;

// Three spheres above each other; the lower two are in compression, the upper two in tension, each
// with `weights`, until 0.5 s.
struct Chain : test::DrawnScene {
  GuideFile guide;
  test::ScratchDirectory directory;

  explicit Chain(double weights) {
    for (int i = 0; i < 3; ++i) add(1, {0, 1.0f + static_cast<float>(i), 0}, test::kGrey, true);
    for (int i = 1; i <= 20; ++i) guide.frames.push_back({.time_s = i / 30.0});
    for (const uint32_t below : {1u, 2u}) {
      guide.forces.push_back({.a = below + 1,
                              .b = below,
                              .arm = Vec3(0, -0.5, 0),
                              .weights = below == 1 ? weights : -weights,
                              .from_s = 0.1,
                              .until_s = 0.5});
    }
  }

  // On white, from 6 m.
  Image draw(uint64_t index) const {
    write_guide_file(directory.path() / "guide.json", guide);
    Image image{.width = kWidth, .height = kHeight};
    image.rgb.assign(size_t{3} * kWidth * kHeight, 255);
    make_overlay(OverlayKind::forces, directory.path())
        ->draw(index, frame, {.position = {0, 2, 6}, .target = {0, 2, 0}}, image);
    return image;
  }
};

enum class Ink { none, push, pull };

Ink ink(const Image& image, int x, int y) {
  const uint8_t* rgb = &image.rgb[3 * (static_cast<size_t>(y) * kWidth + x)];
  if (rgb[0] > 250 && rgb[1] > 250 && rgb[2] > 250) return Ink::none;
  return rgb[2] > rgb[0] ? Ink::push : Ink::pull;
}

size_t inked(const Image& image) {
  size_t count = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) count += ink(image, x, y) == Ink::none ? 0 : 1;
  }
  return count;
}

TEST(ForcesOverlay, TellsPushFromPull) {
  const Image image = Chain(100).draw(10);
  // The middle sphere is in the middle of the picture.
  EXPECT_EQ(ink(image, kWidth / 2, kHeight / 2 + 12), Ink::push);
  EXPECT_EQ(ink(image, kWidth / 2, kHeight / 2 - 12), Ink::pull);
  EXPECT_EQ(ink(image, kWidth / 2 + 12, kHeight / 2 + 12), Ink::none);
}

TEST(ForcesOverlay, LinesAreAsThickAsForcesAreStrong) {
  const auto thin = static_cast<double>(inked(Chain(400).draw(10)));
  const auto thick = static_cast<double>(inked(Chain(1600).draw(10)));
  EXPECT_GT(thick / thin, 1.6);  // twice as wide, except for the faint rim
  EXPECT_LT(thick / thin, 2.2);
}

TEST(ForcesOverlay, ShowsForcesWhileTheyLast) {
  const Chain chain(4);
  EXPECT_EQ(inked(chain.draw(0)), 0u);
  EXPECT_EQ(inked(chain.draw(2)), 0u);
  EXPECT_GT(inked(chain.draw(4)), 0u);
  EXPECT_GT(inked(chain.draw(14)), 0u);
  EXPECT_EQ(inked(chain.draw(15)), 0u);
  EXPECT_EQ(inked(chain.draw(99)), 0u) << "of which guide.json tells nothing";
}

TEST(ForcesOverlay, LeavesOutForcesOfBodiesThatAreNotPresent) {
  Chain chain(100);
  chain.frame.state[3] = 0;  // the upper one
  const Image image = chain.draw(10);
  EXPECT_EQ(ink(image, kWidth / 2, kHeight / 2 + 12), Ink::push);
  EXPECT_EQ(ink(image, kWidth / 2, kHeight / 2 - 12), Ink::none);
  chain.frame.state[2] = 0;
  EXPECT_EQ(inked(chain.draw(10)), 0u);
}

TEST(ForcesOverlay, OfAFileWithoutForcesIsRefused) {
  Chain chain(1);
  chain.guide.forces.clear();
  try {
    chain.draw(10);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::input);
    EXPECT_NE(std::string(error.what()).find("/forces"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace pilesim
