#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/output_directory.h"
#include "core/parallel_for.h"

namespace pilesim {
namespace {

namespace fs = std::filesystem;

class Files : public testing::Test {
 protected:
  void SetUp() override {
    directory_ =
        fs::path(testing::TempDir()) /
        (std::string("pilesim_") + testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::remove_all(directory_);
    fs::create_directories(directory_);
  }
  void TearDown() override { fs::remove_all(directory_); }
  std::vector<std::string> names() const {
    std::vector<std::string> result;
    for (const auto& entry : fs::directory_iterator(directory_)) {
      result.push_back(entry.path().filename().string());
    }
    std::ranges::sort(result);
    return result;
  }
  fs::path directory_;
};

TEST_F(Files, ComeBackAsTheyWereWritten) {
  const std::string text("two\nlines\0and a zero", 20);
  write_file_atomically(directory_ / "a", text);
  EXPECT_EQ(read_file(directory_ / "a"), text);
  write_file_atomically(directory_ / "a", "shorter");
  EXPECT_EQ(read_file(directory_ / "a"), "shorter");
  EXPECT_THAT(names(), testing::ElementsAre("a"));
}

TEST_F(Files, AFailureNamesTheFileAndLeavesNothing) {
  fs::create_directory(directory_ / "a");  // a file cannot take its place
  write_file_atomically(directory_ / "a" / "inside", "x");
  try {
    write_file_atomically(directory_ / "a", "new");
    FAIL() << "wrote over a directory";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::io);
    EXPECT_THAT(error.what(), testing::HasSubstr((directory_ / "a").string()));
  }
  EXPECT_THAT(names(), testing::ElementsAre("a"));
  EXPECT_THROW(write_file_atomically(directory_ / "none" / "b", "x"), Error);
  EXPECT_THROW(read_file(directory_ / "none"), Error);
}

constexpr std::string_view kOwn[] = {"report.json", "store", "frames/frame.*.png"};

TEST_F(Files, OutputIsReplacedByForceAndNothingElseIs) {
  const fs::path out = directory_ / "out";
  fs::create_directories(out / "store" / "inside");
  fs::create_directories(out / "frames");
  for (const char* name : {"report.json", "store/inside/0", "frames/frame.0012.png",
                           "frames/frame.cover.png", "frames/frame..png", "thesis.tex"}) {
    write_file_atomically(out / name, "years of work");
  }
  EXPECT_THROW(claim_output(out, kOwn, false), Error);
  const auto entries = claim_output(out, kOwn, true);
  EXPECT_THAT(entries, testing::ElementsAre(out / "frames/frame.0012.png", out / "report.json",
                                            out / "store"));
  EXPECT_TRUE(fs::exists(out / "report.json"));  // claiming touches nothing
  remove_output(entries);
  EXPECT_THAT(claim_output(out, kOwn, false), testing::IsEmpty());
  for (const char* name : {"frames/frame.cover.png", "frames/frame..png", "thesis.tex"}) {
    EXPECT_EQ(read_file(out / name), "years of work") << name;
  }
}

TEST_F(Files, OutputMayBeALinkAndHoldLinks) {
  fs::create_directories(directory_ / "disk" / "archive");
  write_file_atomically(directory_ / "disk" / "archive" / "0", "old");
  fs::create_directory_symlink("disk", directory_ / "out");
  fs::create_directory_symlink("archive", directory_ / "disk" / "store");
  fs::create_symlink("nowhere", directory_ / "disk" / "report.json");
  const auto entries = claim_output(directory_ / "out", kOwn, true);
  EXPECT_EQ(entries.size(), 2u);
  remove_output(entries);
  make_output_directory(directory_ / "out");
  EXPECT_TRUE(fs::is_symlink(directory_ / "out"));
  EXPECT_EQ(read_file(directory_ / "disk" / "archive" / "0"), "old");
  EXPECT_FALSE(fs::is_symlink(directory_ / "disk" / "report.json"));
}

TEST_F(Files, OutputIsADirectory) {
  write_file_atomically(directory_ / "a", "x");
  EXPECT_THROW(claim_output(directory_ / "a", kOwn, true), Error);
  EXPECT_THROW(claim_output("", kOwn, true), Error);
  EXPECT_THAT(claim_output(directory_ / "none", kOwn, false), testing::IsEmpty());
  EXPECT_THROW(make_output_directory(directory_ / "a" / "b"), Error);
  make_output_directory(directory_ / "b" / "c");
  EXPECT_TRUE(fs::is_directory(directory_ / "b" / "c"));
}

TEST(ParallelFor, GivesTheSameForAnyNumberOfThreadsAndPassesErrorsOn) {
  const auto sum = [](int threads) {
    set_thread_count(threads);
    std::vector<double> values(10007);
    parallel_for(values.size(), 64, [&](size_t begin, size_t end) {
      for (size_t i = begin; i < end; ++i) values[i] = 1.0 / static_cast<double>(i + 1);
    });
    return values;
  };
  const auto one = sum(1);
  EXPECT_EQ(sum(2), one);
  EXPECT_EQ(sum(3), one);
  EXPECT_THROW(parallel_for(100, 1,
                            [](size_t begin, size_t) {
                              if (begin == 57) throw Error(ErrorKind::input, Problem{});
                            }),
               Error);
  set_thread_count(2);
}

}  // namespace
}  // namespace pilesim
