#include "export/export_text.h"

#include <gtest/gtest.h>

#include <cstdlib>

#include "core/philox.h"

namespace pilesim {
namespace {

std::string rounded(float value, int decimals) {
  std::string text;
  append_rounded(text, value, decimals);
  return text;
}

TEST(ExportText, RoundsToDecimalsWithoutZerosAtTheEnd) {
  EXPECT_EQ(rounded(0, 5), "0");
  EXPECT_EQ(rounded(1, 5), "1");
  EXPECT_EQ(rounded(-0.5f, 5), "-0.5");
  EXPECT_EQ(rounded(0.000004f, 5), "0");
  EXPECT_EQ(rounded(-0.000004f, 5), "0");
  EXPECT_EQ(rounded(0.000006f, 5), "0.00001");
  EXPECT_EQ(rounded(12.0625f, 3), "12.063");
  EXPECT_EQ(rounded(99.9996f, 3), "100");
  EXPECT_EQ(rounded(-1e12f, 3), "-1e+12");
}

TEST(ExportText, ErrsByHalfAUnitAtMost) {
  Philox random(1, Stream::test, 0);
  for (int i = 0; i < 10000; ++i) {
    const auto value = static_cast<float>(100 * random.direction().x());
    const std::string text = rounded(value, 3);
    EXPECT_NEAR(std::strtod(text.c_str(), nullptr), value, 0.000501) << text;
  }
}

TEST(ExportText, NumbersAreReadAsTheSameNumber) {
  Philox random(2, Stream::test, 0);
  for (int i = 0; i < 1000; ++i) {
    const auto value = static_cast<float>(random.direction().y());
    std::string text;
    append_number(text, value);
    EXPECT_EQ(std::strtof(text.c_str(), nullptr), value);
  }
}

}  // namespace
}  // namespace pilesim
