#include "json/json_text.h"

#include <gmock/gmock.h>

#include "core/error.h"

namespace pilesim {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::string parse_failure(const std::string& text) {
  try {
    parse_json(text, "s.json");
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::input);
    return error.what();
  }
  return "";
}

// "pointer key-line:column value-line:column" of every value.
std::vector<std::string> places(const std::string& text) {
  std::vector<std::string> lines;
  const LineIndex index(text);
  const auto show = [&](size_t offset) {
    const TextPosition position = index.position(offset);
    return std::to_string(position.line) + ':' + std::to_string(position.column);
  };
  walk_json(text, [&](const JsonPlace& place) {
    lines.push_back(place.pointer + ' ' + show(place.key_offset) + ' ' + show(place.value_offset) +
                    (place.repeats_key ? " again" : ""));
  });
  return lines;
}

TEST(JsonText, WalkGivesThePlaceOfEveryKeyAndValue) {
  EXPECT_THAT(places("{\n  \"a\": [1, {\"b\" : null}],\n\t\"c\": \"x\"}"),
              ElementsAre(" 1:1 1:1", "/a 2:3 2:8", "/a/0 2:9 2:9", "/a/1 2:12 2:12",
                          "/a/1/b 2:13 2:19", "/c 3:2 3:7"));
}

TEST(JsonText, WalkSkipsCommentsAndBracketsInStrings) {
  EXPECT_THAT(places("// {\n/* [ */ [\"]}\\\"\", /* , */ -1.5e3//x\r, true]"),
              ElementsAre(" 2:9 2:9", "/0 2:10 2:10", "/1 2:26 2:26", "/2 2:38 2:38"));
}

TEST(JsonText, ColumnsCountCharactersNotBytes) {
  EXPECT_THAT(places("{\"\u00e4\u00f6\": 1}"), ElementsAre(" 1:1 1:1", "/\u00e4\u00f6 1:2 1:8"));
}

TEST(JsonText, PointersEscapeAndDecodeKeys) {
  EXPECT_THAT(places(R"({"a/b~c": 1, "\u0061": 2})"),
              ElementsAre(" 1:1 1:1", "/a~1b~0c 1:2 1:11", "/a 1:14 1:24"));
}

TEST(JsonText, WalkMarksRepeatedKeys) {
  EXPECT_THAT(places(R"({"a": 1, "b": {"a": 1}, "a": 2})"),
              ElementsAre(" 1:1 1:1", "/a 1:2 1:7", "/b 1:10 1:15", "/b/a 1:16 1:21",
                          "/a 1:25 1:30 again"));
}

TEST(JsonText, SkipsAByteOrderMark) {
  const std::string text = "\xEF\xBB\xBF[1]";
  EXPECT_EQ(parse_json(text, "s.json"), Json::array({1}));
  EXPECT_EQ(places(text).size(), 2u);
}

TEST(JsonText, SyntaxErrorsHavePlaceAndReason) {
  EXPECT_EQ(parse_failure("{\n  \"a\": 1,\n}"),
            "s.json:3:1: is no valid JSON: unexpected '}'; expected string literal. Remove the "
            "comma after the last entry");
  EXPECT_EQ(parse_failure("[1, 2"),
            "s.json:1:6: is no valid JSON: unexpected end of input; expected ']'");
  EXPECT_EQ(parse_failure("{} x"),
            "s.json:1:4: is no valid JSON: invalid literal; last read: '{} x'; expected end of "
            "input");
  EXPECT_EQ(parse_failure(""),
            "s.json:1:1: is no valid JSON: unexpected end of input; expected '[', '{', or a "
            "literal");
}

// The parser ends comments and texts there, so further text would be read or skipped unnoticed.
TEST(JsonText, AByteZeroIsAnError) {
  using namespace std::string_literals;
  for (const std::string& text : {"{\"a\": 1 // b\0}"s, "{}\0 x"s, "\"\0\""s}) {
    EXPECT_THAT(parse_failure(text), HasSubstr("has a byte 0; expected text in UTF-8. Save the "
                                               "file as UTF-8"));
  }
}

TEST(JsonText, NumbersBeyondADoubleAreErrorsWithAPlace) {
  EXPECT_EQ(parse_failure("[1,\n 1e999]"),
            "s.json:2:7: is no valid JSON: number overflow parsing '1e999'");
}

TEST(JsonText, DeepNestingIsAnErrorNotACrash) {
  EXPECT_EQ(parse_failure(std::string(1'000'000, '[')),
            "s.json:1:65: is nested too deeply; expected at most 64 levels");
  EXPECT_EQ(parse_failure(std::string(64, '[') + std::string(64, ']')), "");
}

std::string object_of_keys(size_t count) {
  std::string text = "{";
  for (size_t i = 0; i < count; ++i) {
    text += (i == 0 ? "\"" : ",\"") + std::to_string(i) + "\":1";
  }
  return text + '}';
}

TEST(JsonText, ObjectsOfVeryManyKeysAreRefusedBeforeTheyTakeTheirSquare) {
  EXPECT_EQ(parse_json(object_of_keys(30'000), "s.json").size(), 30'000u);
  EXPECT_THAT(parse_failure(object_of_keys(200'000)),
              HasSubstr("follows one key too many; expected objects of fewer keys"));
  // Many objects of many keys are fine: closed objects do not count.
  std::string many = "[" + object_of_keys(5'000);
  for (int i = 0; i < 60; ++i) many += ',' + object_of_keys(5'000);
  EXPECT_THAT(parse_failure(many + ']'), HasSubstr("follows one key too many"));
  std::string few = "[{}";
  for (int i = 0; i < 200'000; ++i) few += ",{\"a\":{\"b\":1},\"c\":2}";
  EXPECT_EQ(parse_failure(few + ']'), "");
  EXPECT_NE(parse_failure("]]]]]}}{" + std::string(200'000, ':')), "");
}

}  // namespace
}  // namespace pilesim
