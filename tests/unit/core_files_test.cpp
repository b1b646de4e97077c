#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/parallel_for.h"
#include "core/progress.h"

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

TEST_F(Files, OnlyOutputsArePreparedByForce) {
  const std::array<std::string_view, 1> known{"report.json"};
  const fs::path out = directory_ / "out";
  prepare_output_directory(out, false, known);
  EXPECT_TRUE(fs::is_directory(out));
  write_file_atomically(out / "report.json", "{}");
  EXPECT_THROW(prepare_output_directory(out, false, known), Error);
  prepare_output_directory(out, true, known);
  EXPECT_FALSE(fs::exists(out / "report.json"));
  write_file_atomically(out / "thesis.tex", "years of work");
  EXPECT_THROW(prepare_output_directory(out, true, known), Error);
  EXPECT_EQ(read_file(out / "thesis.tex"), "years of work");
}

TEST(ProgressTest, IsSilentWhereNobodyLooks) {
  testing::internal::CaptureStderr();  // stderr is no terminal now
  {
    Progress progress(ProgressMode::automatic, "simulate", 100, "frames");
    for (uint64_t i = 0; i <= 100; ++i) progress.update(i);
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(ProgressTest, JsonTellsTheEndAndNotEveryStep) {
  testing::internal::CaptureStderr();
  {
    Progress progress(ProgressMode::json, "simulate", 100000, "frames");
    for (uint64_t i = 0; i <= 100000; ++i) progress.update(i);
  }
  const std::string text = testing::internal::GetCapturedStderr();
  EXPECT_THAT(text, testing::HasSubstr("100000"));
  EXPECT_LT(std::ranges::count(text, '\n'), 1000);
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
