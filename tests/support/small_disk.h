// A real disk that fills up.
#pragma once

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <string>

namespace pilesim::test {

struct SmallDisk {
  std::filesystem::path directory;
  std::function<void()> make_room;
};

// Runs `scenario` in a child process in which writing more than `bytes` under the given directory
// fails. It uses a tmpfs of that size in the child's own mount namespace or, where mounting is not
// allowed, a limit on the size of every file. Expectations of the scenario count for this test.
inline void on_a_small_disk(size_t bytes, const std::function<void(const SmallDisk&)>& scenario) {
  std::string pattern = (std::filesystem::temp_directory_path() / "small_disk.XXXXXX").string();
  ASSERT_NE(mkdtemp(pattern.data()), nullptr);
  std::fflush(nullptr);
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    SmallDisk disk{.directory = pattern};
    const auto mount_with = [&](unsigned long flags, size_t size) {
      return mount("tmpfs", pattern.c_str(), "tmpfs", flags,
                   ("size=" + std::to_string(size)).c_str());
    };
    const bool own_mounts =
        (unshare(CLONE_NEWNS) == 0 || unshare(CLONE_NEWUSER | CLONE_NEWNS) == 0) &&
        mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0;
    if (own_mounts && mount_with(0, bytes) == 0) {
      disk.make_room = [&] { mount_with(MS_REMOUNT, 64 << 20); };
    } else {
      std::signal(SIGXFSZ, SIG_IGN);  // write() then fails with EFBIG
      rlimit limit;
      getrlimit(RLIMIT_FSIZE, &limit);
      const rlim_t before = limit.rlim_cur;
      limit.rlim_cur = bytes;
      setrlimit(RLIMIT_FSIZE, &limit);
      disk.make_room = [limit, before]() mutable {
        limit.rlim_cur = before;
        setrlimit(RLIMIT_FSIZE, &limit);
      };
    }
    try {
      scenario(disk);
    } catch (const std::exception& error) {
      ADD_FAILURE() << "unexpected exception: " << error.what();
    }
    disk.make_room();  // also for the program's own output, which may go to a file
    std::fflush(nullptr);
    _exit(testing::Test::HasFailure() ? 1 : 0);
  }
  int status = 0;
  waitpid(child, &status, 0);
  std::filesystem::remove_all(pattern);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << "status " << status;
}

// Files left behind by failed writes.
inline size_t count_temporary_files(const std::filesystem::path& directory) {
  size_t count = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(directory)) {
    count += entry.path().extension() == ".tmp";
  }
  return count;
}

}  // namespace pilesim::test
