#include "core/progress.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pty.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>

namespace pilesim {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

TEST(ProgressTest, JsonTellsTheEndAndATenthOfASecondsSteps) {
  // A clock that advances by a millisecond at each call.
  auto now = std::make_shared<Progress::Clock::time_point>();
  const auto tick = [now] { return *now += std::chrono::milliseconds(1); };
  testing::internal::CaptureStderr();
  {
    Progress progress(ProgressMode::json, "simulate", 10000, "frames", tick);
    for (uint64_t i = 0; i <= 10000; ++i) progress.update(i);
  }
  const std::string text = testing::internal::GetCapturedStderr();
  EXPECT_THAT(text, HasSubstr("\"done\":10000"));
  const auto lines = std::ranges::count(text, '\n');
  EXPECT_GE(lines, 90);
  EXPECT_LE(lines, 102);
}

TEST(ProgressTest, IsSilentWhereNobodyLooks) {
  testing::internal::CaptureStderr();  // stderr is not a terminal now
  {
    Progress progress(ProgressMode::automatic, "simulate", 100, "frames");
    for (uint64_t i = 0; i <= 100; ++i) progress.update(i);
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(ProgressTest, ABarFitsIntoAnyWidth) {
  for (const uint64_t total : {1ULL, 600ULL, 10'000'000ULL}) {
    for (const uint64_t done : {uint64_t{0}, total / 3, total}) {
      for (size_t columns = 1; columns <= 200; ++columns) {
        const std::string line =
            progress_line("simulate", "frames", {done, total, 86400.0}, columns);
        EXPECT_LE(line.size(), columns) << line;
        EXPECT_FALSE(line.empty());
      }
    }
  }
}

TEST(ProgressTest, ANarrowTerminalGetsWhatMattersMost) {
  const auto line = [](size_t columns) {
    return progress_line("simulate", "frames", {300, 600, 40}, columns);
  };
  EXPECT_EQ(line(79), "simulate [###############...............] 300/600 frames, 40 s, 40 s left");
  EXPECT_THAT(line(50), AllOf(StartsWith("simulate [##"), HasSubstr("300/600 frames, 40 s, 40 s")));
  EXPECT_EQ(line(45), "simulate 300/600 frames, 40 s, 40 s left");
  EXPECT_EQ(line(39), "simulate 300/600 frames, 40 s left");
  EXPECT_EQ(line(30), "simulate 50%, 40 s left");
  EXPECT_EQ(line(19), "simulate 50%");
}

TEST(ProgressTest, TheTerminalTellsItsWidthElseTheEnvironment) {
  int main = -1, terminal = -1;
  ASSERT_EQ(openpty(&main, &terminal, nullptr, nullptr, nullptr), 0);
  const winsize size{.ws_row = 24, .ws_col = 37, .ws_xpixel = 0, .ws_ypixel = 0};
  ASSERT_EQ(ioctl(terminal, TIOCSWINSZ, &size), 0);
  EXPECT_EQ(terminal_columns(terminal), 37u);
  close(terminal);
  close(main);

  const int file = open("/dev/null", O_WRONLY | O_CLOEXEC);
  setenv("COLUMNS", "52", 1);
  EXPECT_EQ(terminal_columns(file), 52u);
  for (const char* nonsense : {"", "0", "-4", "wide", "52x"}) {
    setenv("COLUMNS", nonsense, 1);
    EXPECT_EQ(terminal_columns(file), 80u) << nonsense;
  }
  unsetenv("COLUMNS");
  EXPECT_EQ(terminal_columns(file), 80u);
  close(file);
}

}  // namespace
}  // namespace pilesim
