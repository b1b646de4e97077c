// The folders of src/ depend on one another in one direction only. Checked on the includes, so that
// a shortcut is seen in review and not years later.

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

// What each folder may include besides itself.
const std::map<std::string, std::set<std::string>> kAllowed = {
    {"core", {}},
    {"geometry", {"core"}},
    {"scene", {"core", "geometry"}},
    {"signature", {"core", "geometry"}},
    {"simulate", {"core", "geometry", "scene", "signature"}},
    {"inspect", {"core", "geometry", "scene", "simulate"}},
    {"pile", {"core", "geometry", "scene", "signature", "simulate"}},
    {"trajectory", {"core"}},
    {"report", {"core", "geometry", "signature", "trajectory"}},
    {"render", {"core", "geometry", "scene", "trajectory"}},
    {"job",
     {"core", "geometry", "scene", "signature", "simulate", "inspect", "pile", "trajectory",
      "report"}},
};

std::vector<std::string> included_folders(const fs::path& file) {
  static const std::regex kInclude(R"rx(^\s*#include "([a-z_]+)/)rx");
  std::vector<std::string> folders;
  std::ifstream stream(file);
  for (std::string line; std::getline(stream, line);) {
    std::smatch match;
    if (std::regex_search(line, match, kInclude)) folders.push_back(match[1]);
  }
  return folders;
}

TEST(DependencyRule, FoldersIncludeOnlyWhatLiesBelowThem) {
  int files = 0;
  for (const auto& entry : fs::recursive_directory_iterator(fs::path(PILESIM_SOURCE_DIR) / "src")) {
    if (entry.path().extension() != ".h" && entry.path().extension() != ".cpp") continue;
    ++files;
    const std::string folder = entry.path().parent_path().filename();
    ASSERT_TRUE(kAllowed.contains(folder)) << folder << " is not in the rule: add it";
    for (const std::string& target : included_folders(entry.path())) {
      EXPECT_TRUE(target == folder || kAllowed.at(folder).contains(target))
          << entry.path() << " includes " << target << "/";
    }
  }
  EXPECT_GT(files, 30);
}

TEST(DependencyRule, HasNoCycle) {
  // Remove folders whose needs are all gone until none is left.
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

// Bullet's types stay inside the impulse simulator's own files, OSMesa's inside the GL context's.
TEST(DependencyRule, LibrariesStayBehindTheirInterface) {
  const std::regex bullet(R"(#include <(bt|Bullet|LinearMath)[^>]*>)");
  const std::regex osmesa(R"(#include <GL/osmesa\.h>)");
  for (const auto& entry : fs::recursive_directory_iterator(fs::path(PILESIM_SOURCE_DIR) / "src")) {
    if (entry.path().extension() != ".h" && entry.path().extension() != ".cpp") continue;
    std::ifstream stream(entry.path());
    for (std::string line; std::getline(stream, line);) {
      if (std::regex_search(line, bullet)) {
        EXPECT_EQ(entry.path().parent_path().filename(), "simulate") << entry.path();
      }
      if (std::regex_search(line, osmesa)) {
        EXPECT_EQ(entry.path().filename(), "gl_context.cpp") << entry.path();
      }
    }
  }
}

}  // namespace
