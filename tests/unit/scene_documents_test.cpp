// docs/scene.md and the presets keep up with the format.
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>

#include "core/atomic_file.h"
#include "scene/scene_loader.h"

namespace pilesim {
namespace {

const std::filesystem::path kRoot = PILESIM_SOURCE_DIR;

void collect_keys(const nlohmann::json& schema, std::set<std::string>& keys) {
  if (schema.is_object() && schema.contains("properties")) {
    for (const auto& [key, property] : schema["properties"].items()) keys.insert(key);
  }
  for (const nlohmann::json& part : schema) {
    if (part.is_structured()) collect_keys(part, keys);
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

TEST(SceneDocuments, ReferenceHasEveryKey) {
  std::set<std::string> keys;
  collect_keys(nlohmann::json::parse(scene_schema()), keys);
  EXPECT_GT(keys.size(), 50u);
  const std::string reference = read_file(kRoot / "docs/scene.md");
  for (const std::string& key : keys) EXPECT_TRUE(has_word(reference, key)) << key;
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
