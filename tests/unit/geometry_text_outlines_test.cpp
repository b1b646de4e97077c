// Letters as solids: areas, holes and convex parts of all printable letters; fonts that are none.
#include "geometry/text_outlines.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/philox.h"
#include "geometry/default_font.h"
#include "geometry/mass_properties.h"
#include "geometry/mesh_check.h"
#include "support/scratch_directory.h"

namespace pilesim {
namespace {

using ::testing::HasSubstr;
using ::testing::SizeIs;

double signed_area(const Outline& outline) {
  double twice = 0;
  for (size_t i = 0; i < outline.size(); ++i) {
    const FlatPoint &a = outline[i], &b = outline[(i + 1) % outline.size()];
    twice += a.x() * b.y() - a.y() * b.x();
  }
  return twice / 2;
}

double polygon_area(const FlatRegion& region, const std::vector<uint32_t>& polygon) {
  Outline outline;
  for (const uint32_t i : polygon) outline.push_back(region.points[i]);
  return signed_area(outline);
}

std::vector<FlatRegion> regions_of(const std::string& letter, double tolerance = 0.001) {
  const std::vector<Letter> letters = text_letters(letter, {});
  EXPECT_THAT(letters, SizeIs(1));
  std::optional<std::vector<FlatRegion>> regions =
      fill_outlines(flattened(letters.at(0), tolerance));
  EXPECT_TRUE(regions) << letter;
  return regions.value_or(std::vector<FlatRegion>());
}

void expect_convex(const FlatRegion& region, const std::vector<uint32_t>& polygon) {
  const auto at = [&](size_t i) { return region.points[polygon[i % polygon.size()]]; };
  for (size_t i = 0; i < polygon.size(); ++i) {
    const FlatPoint in = at(i + 1) - at(i), out = at(i + 2) - at(i + 1);
    EXPECT_GT(in.x() * out.y() - in.y() * out.x(), -1e-9);
  }
}

// Outlines that run the other way are holes, so the sum of all is the letter's area.
TEST(TextOutlines, EveryPrintableLetterIsASolidOfConvexParts) {
  std::string all;
  for (char c = '!'; c <= '~'; ++c) all += c;
  const std::vector<Letter> letters = text_letters(all, {});
  ASSERT_THAT(letters, SizeIs(all.size()));
  for (const double tolerance : {0.001, 0.01}) {
    for (const Letter& letter : letters) {
      SCOPED_TRACE(letter.name);
      double wanted = 0;
      for (const Outline& outline : flattened(letter, tolerance)) wanted += signed_area(outline);
      const auto regions = fill_outlines(flattened(letter, tolerance));
      ASSERT_TRUE(regions);
      double area = 0;
      for (const FlatRegion& region : *regions) {
        area += region.area();
        const TriangleMesh solid = extruded(region, 0.3);
        for (const MeshDefect& defect : find_mesh_defects(solid)) ADD_FAILURE() << defect.text;
        EXPECT_NEAR(mass_properties(solid).volume_m3, 0.3 * region.area(), 1e-9);
        double parts = 0;
        for (const std::vector<uint32_t>& polygon : convex_polygons(region)) {
          expect_convex(region, polygon);
          parts += polygon_area(region, polygon);
        }
        EXPECT_NEAR(parts, region.area(), 1e-9);
      }
      EXPECT_NEAR(area, std::abs(wanted), 1e-9);
    }
  }
}

TEST(TextOutlines, LettersHaveTheirHoles) {
  const auto holes = [](const std::string& letter) {
    std::vector<size_t> count;
    for (const FlatRegion& region : regions_of(letter)) count.push_back(region.outlines.size() - 1);
    return count;
  };
  EXPECT_EQ(holes("I"), std::vector<size_t>({0}));
  EXPECT_EQ(holes("O"), std::vector<size_t>({1}));
  EXPECT_EQ(holes("B"), std::vector<size_t>({2}));
  EXPECT_EQ(holes("8"), std::vector<size_t>({2}));
  EXPECT_EQ(holes("i"), std::vector<size_t>({0, 0}));
  // The cedilla lies over the letter, which is drawn as two outlines that cross.
  EXPECT_EQ(holes("Ç"), std::vector<size_t>({0, 0}));
}

TEST(TextOutlines, ACapitalIsOneHighAndAnIIsARectangle) {
  const std::vector<FlatRegion> regions = regions_of("I");
  ASSERT_THAT(regions, SizeIs(1));
  Eigen::AlignedBox2d bounds;
  for (const FlatPoint& point : regions[0].points) bounds.extend(point);
  EXPECT_NEAR(bounds.min().y(), 0, 1e-12);
  EXPECT_NEAR(bounds.max().y(), 1, 1e-12);
  EXPECT_NEAR(regions[0].area(), bounds.volume(), 1e-12);
  EXPECT_THAT(convex_polygons(regions[0]), SizeIs(1));
}

TEST(TextOutlines, LettersStandSideBySide) {
  double last = -1;
  for (const Letter& letter : text_letters("a b\u00e4", {})) {
    double left = INFINITY;
    for (const Outline& outline : flattened(letter, 0.01)) {
      for (const FlatPoint& point : outline) left = std::min(left, point.x());
    }
    EXPECT_GT(left, last + 0.5);
    last = left;
  }
  EXPECT_THAT(text_letters("a b\u00e4", {}), SizeIs(3));
  EXPECT_EQ(text_letters("\u00e4", {}).at(0).name, "U+00E4");
}

TEST(TextOutlines, ChordsAreAsNearAsAskedFor) {
  const Letter letter = text_letters("O", {}).at(0);
  const double fine = std::abs(signed_area(flattened(letter, 1e-5).at(0)));
  const double coarse = std::abs(signed_area(flattened(letter, 0.01).at(0)));
  EXPECT_LT(coarse, fine);
  EXPECT_GT(coarse, fine - 0.01 * 3);  // at most 3 around
}

TEST(TextOutlines, OutlinesThatCrossAreRefused) {
  const Outline square = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  const Outline bow = {{0, 0}, {1, 1}, {1, 0}, {0, 1.5}};
  const Outline hole_across = {{0.5, 0.5}, {0.5, 0.8}, {1.5, 0.8}, {1.5, 0.5}};
  const Outline hole_beside = {{2, 0}, {2, 0.5}, {2.5, 0.5}, {2.5, 0}};
  EXPECT_TRUE(fill_outlines({square}));
  EXPECT_FALSE(fill_outlines({bow}));
  EXPECT_FALSE(fill_outlines({square, hole_across}));
  EXPECT_FALSE(fill_outlines({square, hole_beside}));
}

class Font : public ::testing::Test {
 protected:
  std::string failure(const std::string& bytes, const std::string& text = "Ab8") {
    write_file_atomically(directory_ / "font.ttf", bytes);
    try {
      text_letters(text, directory_ / "font.ttf");
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  }
  test::ScratchDirectory directory_;
};

TEST_F(Font, OtherFilesAreRefusedByName) {
  EXPECT_THAT(failure(""), HasSubstr("font.ttf: is no TrueType or OpenType font"));
  EXPECT_THAT(failure("no font at all, but some text"), HasSubstr("is no TrueType"));
  EXPECT_EQ(failure(std::string(default_font())), "");
  EXPECT_THAT(failure(std::string(default_font()), "\u4e2d"),
              HasSubstr("has no letter for U+4E2D"));
}

// The reader believes its file; nothing that it does then ends this process.
TEST_F(Font, BrokenOnesEndInAnErrorOrInLetters) {
  Philox random(1, Stream::test, 0);
  for (int i = 0; i < 20; ++i) {
    std::string bytes(default_font());
    for (int k = 0; k < 40; ++k) {
      // Every second one in the tables of contents.
      const auto size = static_cast<uint32_t>(bytes.size());
      const uint32_t at = random.index(k % 2 == 0 ? 400 : size);
      bytes[at] = static_cast<char>(random.index(256));
    }
    failure(bytes);
  }
  failure(std::string(default_font().substr(0, 1000)));
}

}  // namespace
}  // namespace pilesim
