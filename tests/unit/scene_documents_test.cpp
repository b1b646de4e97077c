// docs/scene.md and the presets match the format.
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <sstream>
#include <vector>

#include "core/atomic_file.h"
#include "scene/scene_loader.h"

namespace pilesim {
namespace {

const std::filesystem::path kRoot = PILESIM_SOURCE_DIR;

// Without those of the values of `elsewhere`.
void collect_keys(const nlohmann::json& schema, std::set<std::string>& keys,
                  const std::set<std::string>& elsewhere = {}) {
  if (schema.is_object() && schema.contains("properties")) {
    for (const auto& [key, property] : schema["properties"].items()) keys.insert(key);
  }
  for (const auto& [name, part] : schema.items()) {
    if (part.is_structured() && !elsewhere.contains(name)) collect_keys(part, keys, elsewhere);
  }
}

bool is_word_character(char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_'; }

bool has_word(const std::string& text, const std::string& word) {
  for (size_t at = text.find(word); at != text.npos; at = text.find(word, at + 1)) {
    const size_t end = at + word.size();
    if ((at == 0 || !is_word_character(text[at - 1])) &&
        (end == text.size() || !is_word_character(text[end]))) {
      return true;
    }
  }
  return false;
}

// The text of `## title`, up to the next such heading.
std::string section(const std::string& text, const std::string& title) {
  const size_t begin = text.find("\n## " + title + "\n");
  EXPECT_NE(begin, text.npos) << title;
  if (begin == text.npos) return "";
  return text.substr(begin, text.find("\n## ", begin + 1) - begin);
}

// Keys in the first column of tables, each without its object ("simulator/mode"). Quoted values are
// not keys.
std::set<std::string> keys_in_tables(const std::string& text) {
  std::set<std::string> keys;
  const std::regex key("`([^`]+)`");
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("| ")) continue;
    const std::string cell = line.substr(1, line.find('|', 1) - 1);
    for (std::sregex_iterator match(cell.begin(), cell.end(), key), end; match != end; ++match) {
      const std::string name = (*match)[1];
      if (!name.starts_with('"')) keys.insert(name.substr(name.rfind('/') + 1));
    }
  }
  return keys;
}

// The sections of docs/scene.md, and the scene keys whose objects they describe.
const std::map<std::string, std::vector<std::string>> kSections = {
    {"Materials", {"materials"}},
    {"Shapes", {"shapes"}},
    {"Bodies", {"bodies"}},
    {"Joints", {"joints", "chains"}},
    {"Emitters", {"emitters"}},
    {"Events", {"events"}},
    {"Piles", {"piles"}},
    {"Guide", {"guide"}},
    {"Finish", {"finish"}},
    {"Simulator, camera, render", {"simulator", "camera", "cameras", "render"}}};

void expect_subset(const std::set<std::string>& keys, const std::set<std::string>& all,
                   const std::string& where) {
  for (const std::string& key : keys) EXPECT_TRUE(all.contains(key)) << key << ": " << where;
}

TEST(SceneDocuments, TopLevelHasTheKeysOfAScene) {
  const nlohmann::json schema = nlohmann::json::parse(scene_schema());
  std::set<std::string> keys;
  for (const auto& [key, property] : schema["properties"].items()) keys.insert(key);
  const std::string text = section(read_file(kRoot / "docs/scene.md"), "Top level");
  expect_subset(keys, keys_in_tables(text), "not at the top level of docs/scene.md");
  expect_subset(keys_in_tables(text), keys, "not in the schema");
}

TEST(SceneDocuments, EachSectionHasTheKeysOfItsObjects) {
  const nlohmann::json schema = nlohmann::json::parse(scene_schema());
  const std::string reference = read_file(kRoot / "docs/scene.md");
  std::set<std::string> described;
  for (const auto& [title, objects] : kSections) {
    std::set<std::string> keys, elsewhere;
    if (title == "Emitters") elsewhere = {"motion", "motors"};  // as those of bodies
    for (const std::string& object : objects) {
      collect_keys(schema["properties"][object], keys, elsewhere);
      described.insert(object);
    }
    const std::string text = section(reference, title);
    for (const std::string& key : keys) {
      EXPECT_TRUE(has_word(text, key)) << key << " is not in the section " << title;
    }
    expect_subset(keys_in_tables(text), keys, "in the section " + title + ", not in the schema");
  }
  for (const auto& [key, property] : schema["properties"].items()) {
    std::set<std::string> inside;
    collect_keys(property, inside);
    EXPECT_TRUE(inside.empty() || described.contains(key)) << key << " has no section";
  }
}

TEST(SceneDocuments, WorkedExampleLoads) {
  const std::string reference = read_file(kRoot / "docs/scene.md");
  const size_t begin = reference.find("```json\n") + 8;
  const std::string example = reference.substr(begin, reference.find("```", begin) - begin);
  EXPECT_NO_THROW(parse_scene(example, kRoot / "docs/example.json"));
}

TEST(SceneDocuments, PresetsLoadAndTheirMeshesExist) {
  int presets = 0;
  for (const auto& entry : std::filesystem::directory_iterator(kRoot / "presets/impulse")) {
    if (entry.path().extension() != ".json") continue;
    const Scene scene = load_scene(entry.path()).scene;
    ++presets;
    for (const auto& [name, shape] : scene.shapes) {
      const auto* mesh = std::get_if<MeshShape>(&shape);
      EXPECT_TRUE(mesh == nullptr || std::filesystem::exists(mesh->file)) << mesh->file;
    }
  }
  EXPECT_GE(presets, 4);
}

}  // namespace
}  // namespace pilesim
