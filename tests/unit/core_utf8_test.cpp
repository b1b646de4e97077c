#include "core/utf8.h"

#include <gtest/gtest.h>

#include <string>

namespace pilesim {
namespace {

std::u32string decoded(std::string_view text) {
  std::u32string characters;
  while (!text.empty()) characters += take_character(text);
  return characters;
}

std::string encoded(char32_t c) {
  const auto byte = [](char32_t bits) { return static_cast<char>(bits); };
  if (c < 0x80) return {byte(c)};
  if (c < 0x800) return {byte(0xC0 | c >> 6), byte(0x80 | (c & 0x3F))};
  if (c < 0x10000) {
    return {byte(0xE0 | c >> 12), byte(0x80 | (c >> 6 & 0x3F)), byte(0x80 | (c & 0x3F))};
  }
  return {byte(0xF0 | c >> 18), byte(0x80 | (c >> 12 & 0x3F)), byte(0x80 | (c >> 6 & 0x3F)),
          byte(0x80 | (c & 0x3F))};
}

TEST(Utf8, EveryCodePointIsItself) {
  for (char32_t c = 0; c < 0x110000; ++c) {
    const bool surrogate = c >= 0xD800 && c < 0xE000;
    const std::string text = encoded(c);
    const std::u32string back = decoded(text);
    if (surrogate) {
      ASSERT_EQ(back, std::u32string(text.size(), kReplacementCharacter)) << std::hex << +c;
    } else {
      ASSERT_EQ(back, std::u32string(1, c)) << std::hex << +c;
    }
  }
}

TEST(Utf8, WhatIsNoneBecomesReplacementCharacters) {
  constexpr char32_t r = kReplacementCharacter;
  EXPECT_EQ(decoded("\x80"), std::u32string({r}));
  EXPECT_EQ(decoded("\xC0\xAF"), std::u32string({r, r}));  // overlong
  EXPECT_EQ(decoded("\xE0\x80\xAF"), std::u32string({r, r, r}));
  EXPECT_EQ(decoded("\xF4\x90\x80\x80"), std::u32string({r, r, r, r}));  // beyond the last
  EXPECT_EQ(decoded("a\xE2\x82"), std::u32string({U'a', r}));            // ends early
  EXPECT_EQ(decoded("\xE2\x82"
                    "b"),
            std::u32string({r, U'b'}));
  EXPECT_EQ(decoded("\xFF\xFE"), std::u32string({r, r}));
}

}  // namespace
}  // namespace pilesim
