// Whatever happens to the text of a scene, loading it gives a scene or an Error(input).
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "../unit/scene_test_support.h"
#include "core/philox.h"

namespace pilesim {
namespace {

class Mutator {
 public:
  explicit Mutator(uint32_t object) : dice_(5, Stream::test, object) {}

  std::string mutate(std::string text) {
    const uint32_t changes = 1 + dice_.index(2);
    for (uint32_t i = 0; i < changes; ++i) change(text);
    return text;
  }

 private:
  size_t place(const std::string& text) {
    return dice_.index(static_cast<uint32_t>(text.size() + 1));
  }

  void change(std::string& text) {
    static const std::vector<std::string> kPieces = {
        "{",    "}",     "[",       "]",  ",",    ":",    "\"",        "null",
        "-1",   "1e308", "1e999",   "0",  "1e-9", "true", "\"type\"",  "//",
        "/*",   "*/",    "\\u0000", "\\", "\xff", "[[[[", "{\"a\":1}", "\"shape\": 1",
        "9e18", "\r",    "\""};
    const size_t at = place(text);
    const size_t length = std::min<size_t>(dice_.index(30), text.size() - at);
    switch (dice_.index(8)) {
      case 0:
        text.erase(at, length);
        break;
      case 1:
        text.insert(at, kPieces[dice_.index(static_cast<uint32_t>(kPieces.size()))]);
        break;
      case 2:
        text.insert(place(text), text.substr(at, length));
        break;
      case 3:
        if (at < text.size()) text[at] = static_cast<char>(dice_.index(256));
        break;
      default:
        replace_value(text, at);
        break;
    }
  }

  // Replaces a number, string or word by another value, which mostly leaves valid JSON.
  void replace_value(std::string& text, size_t near) {
    static const std::vector<std::string> kValues = {"0",
                                                     "-1",
                                                     "1e300",
                                                     "1.5",
                                                     "null",
                                                     "true",
                                                     "[]",
                                                     "{}",
                                                     "\"\"",
                                                     "\"rabbit\"",
                                                     "[1, 2, 3]",
                                                     "\"grid\"",
                                                     "\"mesh\"",
                                                     "\"plane\"",
                                                     "\"rain\"",
                                                     "18446744073709551616",
                                                     "{\"keys\": []}"};
    const size_t colon = text.find(": ", near);
    if (colon == text.npos) return;
    const size_t end = text.find_first_of(",}]\n", colon);
    if (end == text.npos) return;
    text.replace(colon + 2, end - colon - 2,
                 kValues[dice_.index(static_cast<uint32_t>(kValues.size()))]);
  }

  Philox dice_;
};

TEST(SceneMutation, GivesASceneOrAnInputError) {
  constexpr uint32_t kMutations = 6000;
  uint32_t scenes = 0;
  for (uint32_t i = 0; i < kMutations; ++i) {
    const std::string text = Mutator(i).mutate(kFullScene);
    try {
      const LoadedScene loaded = parse(text);
      ++scenes;
      EXPECT_EQ(parse_scene(loaded.resolved, "/r.json").resolved, loaded.resolved) << text;
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::input) << text;
      ASSERT_FALSE(error.problems().empty());
      for (const Problem& problem : error.problems()) {
        EXPECT_EQ(problem.file, "/scenes/scene.json");
        EXPECT_GT(problem.line, 0) << error.what();
        EXPECT_GT(problem.column, 0) << error.what();
        EXPECT_FALSE(problem.found.empty());
      }
    }
  }
  // Both outcomes must be frequent for the test to be meaningful.
  EXPECT_GT(scenes, kMutations / 50);
  EXPECT_LT(scenes, kMutations / 2);
}

TEST(SceneMutation, OverridesGiveASceneOrAnInputError) {
  const std::vector<std::string> pointers = {"",
                                             "/",
                                             "/name",
                                             "/bodies",
                                             "/bodies/0",
                                             "/bodies/9",
                                             "/bodies/-1",
                                             "/bodies/x",
                                             "/bodies/0/shape",
                                             "/shapes/brick/size/0",
                                             "/camera",
                                             "/events/1",
                                             "/simulator/x",
                                             "/emitters/0/count",
                                             "/a~1b/~0/c",
                                             "/render/~",
                                             "/version",
                                             "/materials/wood/friction/5"};
  const std::vector<std::string> values = {"",      "1",  "-1",    "null", "{}",   "[]", "\"x\"",
                                           "brick", "[[", "1e999", "true", "\xff", "a=b"};
  for (const std::string& pointer : pointers) {
    for (const std::string& value : values) {
      try {
        parse(kFullScene, {pointer + '=' + value});
      } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::input);
        EXPECT_FALSE(error.problems().empty());
      }
    }
  }
}

}  // namespace
}  // namespace pilesim
