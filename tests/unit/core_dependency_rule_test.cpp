// The folders of src/ depend on each other in one direction only. The test checks includes, so that
// a shortcut is noticed in review and not years later.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <string>

namespace {

namespace fs = std::filesystem;

// The folders that each folder may include besides itself.
const std::map<std::string, std::set<std::string>> kAllowed = {
    {"core", {}},
    {"json", {"core"}},
    {"geometry", {"core", "json"}},
    {"scene", {"core", "json"}},
    {"model", {"core", "json", "geometry", "scene"}},
    {"signature/rest", {"core", "geometry"}},
    {"signature/trial", {"core", "geometry"}},
    {"signature/table", {"core", "signature/trial"}},
    {"signature/spline", {"core", "signature/table"}},
    {"signature",
     {"core", "json", "geometry", "signature/rest", "signature/trial", "signature/table",
      "signature/spline"}},
    {"simulate", {"core", "scene", "model"}},
    {"simulate/bullet", {"core", "scene", "model", "simulate"}},
    {"simulate/exact", {"core", "geometry", "scene", "model", "simulate"}},
    {"simulate/sphere",
     {"core", "geometry", "scene", "model", "signature", "signature/rest", "signature/table",
      "simulate"}},
    {"simulate/dissertation", {"core", "model", "signature", "simulate", "simulate/sphere"}},
    {"simulate/mixed",
     {"core", "geometry", "scene", "model", "simulate", "simulate/sphere",
      "simulate/dissertation"}},
    {"simulate/modes",
     {"core", "scene", "model", "simulate", "simulate/bullet", "simulate/exact", "simulate/sphere",
      "simulate/dissertation", "simulate/mixed"}},
    {"packing",
     {"core", "geometry", "scene", "model", "signature", "simulate", "simulate/modes",
      "simulate/sphere"}},
    {"trajectory", {"core", "json"}},
    {"inspect", {"core", "geometry", "model", "simulate"}},
    {"pile/repose", {"core", "geometry", "scene", "model", "simulate"}},
    {"pile/glue", {"core"}},
    {"pile/guide",
     {"core", "geometry", "scene", "model", "simulate", "simulate/exact", "simulate/modes",
      "pile/glue", "trajectory"}},
    {"finish", {"core", "geometry", "scene", "model", "simulate", "simulate/exact", "trajectory"}},
    {"report", {"core", "json", "geometry", "signature/rest", "trajectory"}},
    {"render", {"core", "json", "geometry", "scene", "trajectory"}},
    {"render/rays", {"core", "geometry", "scene", "trajectory", "render"}},
    {"render/dataset",
     {"core", "json", "geometry", "scene", "trajectory", "render", "render/rays"}},
    {"export", {"core", "scene", "trajectory", "render", "render/dataset"}},
    {"batch", {"core", "json", "scene"}},
    {"view", {"core", "scene", "trajectory", "render", "export"}},
    {"job",
     {"core", "json", "geometry", "scene", "model", "signature", "signature/rest",
      "signature/trial", "simulate", "simulate/modes", "packing", "inspect", "pile/repose",
      "pile/guide", "trajectory", "finish", "report", "render"}},
};

std::vector<std::string> included_folders(const fs::path& file) {
  static const std::regex kInclude(R"rx(^\s*#include "([a-z_/]+)/[a-z_0-9]+\.h")rx");
  std::vector<std::string> folders;
  std::ifstream stream(file);
  for (std::string line; std::getline(stream, line);) {
    std::smatch match;
    if (std::regex_search(line, match, kInclude)) folders.push_back(match[1]);
  }
  return folders;
}

std::string folder_of(const fs::path& file) {
  return fs::relative(file.parent_path(), fs::path(PILESIM_SOURCE_DIR) / "src").string();
}

TEST(DependencyRule, FoldersIncludeOnlyWhatLiesBelowThem) {
  int files = 0;
  for (const auto& entry : fs::recursive_directory_iterator(fs::path(PILESIM_SOURCE_DIR) / "src")) {
    if (entry.path().extension() != ".h" && entry.path().extension() != ".cpp") continue;
    ++files;
    const std::string folder = folder_of(entry.path());
    ASSERT_TRUE(kAllowed.contains(folder)) << folder << " is not in the rule: add it";
    for (const std::string& target : included_folders(entry.path())) {
      EXPECT_TRUE(target == folder || kAllowed.at(folder).contains(target))
          << entry.path() << " includes " << target << "/";
    }
  }
  EXPECT_GT(files, 30);
}

TEST(DependencyRule, HasNoCycle) {
  // Remove folders whose dependencies are all removed, until none is left.
  auto left = kAllowed;
  for (bool progress = true; progress && !left.empty();) {
    progress = false;
    for (auto it = left.begin(); it != left.end();) {
      bool free = true;
      for (const std::string& need : it->second) free = free && !left.contains(need);
      it = free ? left.erase(it) : std::next(it);
      progress = progress || free;
    }
  }
  EXPECT_THAT(left, testing::IsEmpty());
}

// Bullet's types stay inside its engine's folder, OSMesa's inside the GL context's file, OpenEXR's
// inside its own. Nobody calls what takes seconds to compile.
TEST(DependencyRule, LibrariesStayBehindTheirInterface) {
  const std::regex bullet(R"(#include <(bt|Bullet|LinearMath)[^>]*>)");
  const std::regex osmesa(R"(#include <GL/osmesa\.h>)");
  const std::regex open_exr(R"(#include <(OpenEXR|Imath)/)");
  const std::regex two_vectors("FromTwoVectors[(]");
  for (const auto& entry : fs::recursive_directory_iterator(fs::path(PILESIM_SOURCE_DIR) / "src")) {
    if (entry.path().extension() != ".h" && entry.path().extension() != ".cpp") continue;
    std::ifstream stream(entry.path());
    for (std::string line; std::getline(stream, line);) {
      if (std::regex_search(line, bullet)) {
        EXPECT_EQ(folder_of(entry.path()), "simulate/bullet") << entry.path();
      }
      if (std::regex_search(line, osmesa)) {
        EXPECT_EQ(entry.path().filename(), "gl_context.cpp") << entry.path();
      }
      if (std::regex_search(line, open_exr)) {
        EXPECT_EQ(entry.path().filename(), "exr.cpp") << entry.path();
      }
      if (std::regex_search(line, two_vectors)) {
        ADD_FAILURE() << entry.path() << ": rotation_between() of core/rotation.h does the same";
      }
    }
  }
}

}  // namespace
