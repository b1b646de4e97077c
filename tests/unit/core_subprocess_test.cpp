#include "core/subprocess.h"
#include "support/thrown_error.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>

#include "core/error.h"

namespace pilesim {
namespace {

using testing::HasSubstr;

TEST(Subprocess, GivesBackWhatTheProgramMakesOfItsInput) {
  EXPECT_EQ(run_program({"tr", "a-z", "A-Z"}, "coreutils", "pile of bodies"), "PILE OF BODIES");
}

TEST(Subprocess, PassesArgumentsAsTheyAre) {
  EXPECT_EQ(run_program({"printf", "%s|", "a b", "$HOME", "'\"*;"}, "coreutils"),
            "a b|$HOME|'\"*;|");
}

// Far more than a pipe holds, in both directions at once: would hang if output used a pipe.
TEST(Subprocess, SurvivesMuchInputAndMuchOutput) {
  std::string input(20 << 20, 'x');
  input.back() = '\n';
  EXPECT_EQ(run_program({"cat"}, "coreutils", input), input);
}

TEST(Subprocess, NamesThePackageOfAMissingProgram) {
  EXPECT_EQ(test::error_text([] { Subprocess({"no-such-program-anywhere"}, "some-package"); },
                             ErrorKind::io),
            "no-such-program-anywhere: this program is needed and not installed. Install it: apt "
            "install some-package");
}

TEST(Subprocess, ReportsStatusAndLastWordsOfAFailure) {
  EXPECT_EQ(test::error_text(
                [] {
                  run_program({"sh", "-c", "echo out; echo no such codec >&2; exit 3"}, "dash");
                },
                ErrorKind::io),
            "sh: failed with exit status 3: no such codec");
}

TEST(Subprocess, ReportsAProgramThatStopsReadingWithoutSigpipe) {
  std::signal(SIGPIPE, SIG_DFL);  // the signal would end the test program
  const std::string much(1 << 20, 'x');
  EXPECT_THAT(test::error_text(
                  [&] {
                    run_program({"sh", "-c", "echo full >&2; exit 1"}, "dash", much);
                  },
                  ErrorKind::io),
              HasSubstr("failed with exit status 1: full"));
  EXPECT_THAT(test::error_text([&] { run_program({"true"}, "coreutils", much); }, ErrorKind::io),
              HasSubstr("ended before it had read all of its input"));
  sigset_t pending;
  sigpending(&pending);
  EXPECT_EQ(sigismember(&pending, SIGPIPE), 0);
}

TEST(Subprocess, TellsTheSignalThatEndedTheProgram) {
  Subprocess process({"sh", "-c", "kill -9 $$"}, "dash");
  EXPECT_EQ(process.wait().exit_status, 128 + SIGKILL);
}

TEST(Subprocess, KeepsOutputAndErrorsApart) {
  Subprocess process({"sh", "-c", "echo one; echo two >&2"}, "dash");
  const SubprocessResult result = process.wait();
  EXPECT_EQ(result.exit_status, 0);
  EXPECT_EQ(result.output, "one\n");
  EXPECT_EQ(result.errors, "two\n");
}

// Would wait an hour if the destructor did not end the child.
TEST(Subprocess, KillsAnAbandonedProgram) {
  const Subprocess process({"sleep", "3600"}, "coreutils");
}

// A program that reads nothing would run for ever.
TEST(Subprocess, DiesWithAParentThatIsKilled) {
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  const pid_t parent = fork();
  ASSERT_GE(parent, 0);
  if (parent == 0) {
    // The program keeps the pipe open as long as it lives.
    const Subprocess program(
        {"sh", "-c", "echo >&" + std::to_string(ends[1]) + "; exec sleep 3600"}, "dash");
    for (;;) pause();
  }
  close(ends[1]);
  char byte;
  ASSERT_EQ(read(ends[0], &byte, 1), 1);
  kill(parent, SIGKILL);
  waitpid(parent, nullptr, 0);
  EXPECT_EQ(read(ends[0], &byte, 1), 0);  // would wait an hour
  close(ends[0]);
}

// A child that inherited another child's pipe would keep it open for ever.
TEST(Subprocess, LeavesNoDescriptorsInTheChild) {
  const std::vector<std::string> list = {"ls", "/proc/self/fd"};
  const std::string alone = run_program(list, "coreutils");
  const Subprocess other({"sleep", "3600"}, "coreutils");
  EXPECT_EQ(run_program(list, "coreutils"), alone);
}

}  // namespace
}  // namespace pilesim
