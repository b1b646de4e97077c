#include "core/printable.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/counted.h"
#include "core/error.h"

namespace pilesim {
namespace {

using testing::EndsWith;
using testing::HasSubstr;
using testing::Not;

TEST(Printable, KeepsTextInAnyLanguage) {
  for (const std::string text :
       {"", "a box", "Größe", "箱", "ящик", "می‌خواهم", "👩‍🚀", "\\n"}) {
    EXPECT_EQ(printable(text), text);
  }
}

TEST(Printable, EscapesWhatATerminalActsOn) {
  EXPECT_EQ(printable("\x1b[31mred\x1b[0m"), "\\u001b[31mred\\u001b[0m");
  EXPECT_EQ(printable("a\r\n\tb\x7f"), "a\\u000d\\u000a\\u0009b\\u007f");
  EXPECT_EQ(printable(std::string("a\0b", 3)), "a\\u0000b");
  EXPECT_EQ(printable("\xC2\x9B"
                      "2J"),
            "\\u009b2J");  // C1 in UTF-8
  EXPECT_EQ(printable("\x9B"
                      "2J"),
            "\\x9b2J");                                     // and as a byte
  EXPECT_EQ(printable("\u202Egnp.exe"), "\\u202egnp.exe");  // right to left
  EXPECT_EQ(printable("\u2066\u2069\u061C\u2028"), "\\u2066\\u2069\\u061c\\u2028");
  EXPECT_EQ(printable_lines("a\nb\x1b"), "a\nb\\u001b");
}

TEST(Printable, EscapesBytesThatAreNoUtf8) {
  EXPECT_EQ(printable("\xC0\x9B"), "\\xc0\\x9b");           // two bytes for one
  EXPECT_EQ(printable("\xE0\x82\x9B"), "\\xe0\\x82\\x9b");  // three for two
  EXPECT_EQ(printable("\xED\xA0\x80"), "\\xed\\xa0\\x80");  // a surrogate
  EXPECT_EQ(printable("\xF4\x90\x80\x80"), "\\xf4\\x90\\x80\\x80");
  EXPECT_EQ(printable("\xE7\xAE"), "\\xe7\\xae");  // cut short
}

TEST(Printable, KeepsTheMeaningOfJson) {
  const nlohmann::json value = {{"name\u009B\x7f", "\x1b\u202E\n"}};
  const std::string text = printable_lines(value.dump(2));
  EXPECT_EQ(nlohmann::json::parse(text), value);
  EXPECT_EQ(printable_lines(text), text);
}

TEST(Printable, ShortensBetweenCharacters) {
  EXPECT_EQ(shortened("pile", 4), "pile");
  EXPECT_EQ(shortened("piles", 4), "pile...");
  EXPECT_EQ(shortened("ab箱", 4), "ab...");
}

TEST(ShellWord, IsQuotedWhereAShellWouldTakeItApart) {
  EXPECT_EQ(shell_word("out/scene-1.json"), "out/scene-1.json");
  EXPECT_EQ(shell_word("ünï.json"), "ünï.json");
  EXPECT_EQ(shell_word("my scene.json"), "'my scene.json'");
  EXPECT_EQ(shell_word("a'b;c"), R"('a'\''b;c')");
  EXPECT_EQ(shell_word(""), "''");
}

TEST(Counted, HasThePlural) {
  EXPECT_EQ(counted(1, "frame"), "1 frame");
  EXPECT_EQ(counted(0, "frame"), "0 frames");
  EXPECT_EQ(counted(1, "body", "bodies"), "1 body");
  EXPECT_EQ(counted(2, "body", "bodies"), "2 bodies");
}

TEST(ErrorText, IsOneSafeLineAProblem) {
  const std::string evil = "\x1b]0;title\x07\nall is well";
  const Problem problem{.file = evil, .pointer = evil, .found = evil, .expected = evil};
  EXPECT_THAT(to_string(problem), Not(HasSubstr("\x1b")));
  EXPECT_THAT(to_string(problem), Not(HasSubstr("\n")));
  const std::string endless(1 << 20, 'x');
  EXPECT_LT(to_string({.file = "s", .pointer = endless, .found = endless}).size(), 3000u);
}

TEST(ErrorText, ManyProblemsAreCounted) {
  const auto text = [](size_t count) -> std::string {
    return Error(ErrorKind::input, std::vector<Problem>(count, {.found = "is wrong"})).what();
  };
  EXPECT_EQ(std::ranges::count(text(50), '\n'), 49);
  EXPECT_EQ(std::ranges::count(text(60000), '\n'), 50);
  EXPECT_THAT(text(60000), EndsWith("\nand 59950 more problems"));
  EXPECT_THAT(text(51), EndsWith("\nand 1 more problem"));
}

}  // namespace
}  // namespace pilesim
