#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/output_directory.h"
#include "core/parallel_for.h"
#include "core/temporary_file.h"

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
  fs::create_directory(directory_ / "a");  // a file cannot replace it
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

TEST_F(Files, TheNextProcessRemovesOnlyFilesOfAKilledOne) {
  // As if killed, also by an earlier process with the same id.
  const std::string mine = ".pilesim." + std::to_string(getpid()) + ".0.tmp";
  for (const std::string& name : {mine, std::string(".pilesim.1.7.tmp")}) {
    std::ofstream(directory_ / name) << "half of a rep";
  }
  fs::create_directories(directory_ / ".pilesim.1.8.tmp" / "position");
  std::ofstream(directory_ / ".pilesim.1.8.tmp" / "position" / "0.0.0") << "x";
  for (const char* name :
       {".pilesim.tmp", ".pilesim.x.tmp", ".pilesim.1.7.tmp~", "pilesim.1.tmp"}) {
    std::ofstream(directory_ / name) << "of somebody else";
  }
  // Another active process, as its lock shows.
  const int held = open((directory_ / ".pilesim.1.9.tmp").c_str(), O_CREAT | O_WRONLY, 0666);
  ASSERT_EQ(flock(held, LOCK_EX), 0);
  write_file_atomically(directory_ / "a", "x");
  EXPECT_THAT(names(), testing::ElementsAre(".pilesim.1.7.tmp~", ".pilesim.1.9.tmp", ".pilesim.tmp",
                                            ".pilesim.x.tmp", "a", "pilesim.1.tmp"));
  close(held);
}

TEST_F(Files, AFileInTheMakingIsNoOnesLeftover) {
  TemporaryFile file(directory_ / "a");
  const int other = open(file.name().c_str(), O_WRONLY);
  EXPECT_NE(flock(other, LOCK_EX | LOCK_NB), 0);
  close(other);
  EXPECT_FALSE(fs::exists(directory_ / "a"));
  file.take_place();
  EXPECT_THAT(names(), testing::ElementsAre("a"));
  { const TemporaryFile given_up(directory_ / "b"); }
  EXPECT_THAT(names(), testing::ElementsAre("a"));
}

TEST_F(Files, AResultThatIsOneFileIsClaimedBeforeAnyWork) {
  const fs::path file = directory_ / "a.sig";
  claim_output_file(file, false);
  EXPECT_THAT(names(), testing::IsEmpty());
  write_file_atomically(file, "old");
  EXPECT_THROW(claim_output_file(file, false), Error);
  claim_output_file(file, true);
  EXPECT_EQ(read_file(file), "old");
  const auto kind_of = [](const fs::path& path) {
    try {
      claim_output_file(path, true);
    } catch (const Error& error) {
      return error.kind();
    }
    return ErrorKind::internal;
  };
  // A rename would replace the device by a file.
  EXPECT_EQ(kind_of("/dev/null"), ErrorKind::usage);
  EXPECT_EQ(kind_of(directory_), ErrorKind::io);
  EXPECT_EQ(kind_of(""), ErrorKind::usage);
  EXPECT_EQ(kind_of(directory_ / "none" / "a.sig"), ErrorKind::io);
  EXPECT_EQ(kind_of(directory_ / std::string(300, 'x')), ErrorKind::io);
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
  EXPECT_TRUE(fs::exists(out / "report.json"));  // claiming changes nothing
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
