#include "core/isolated.h"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <fstream>
#include <new>

#include "core/error.h"

#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define PILESIM_SANITIZED 1
#endif
#endif
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define PILESIM_SANITIZED 1
#endif
#ifdef PILESIM_SANITIZED
#include <sanitizer/common_interface_defs.h>
#endif

namespace pilesim {
namespace {

constexpr int kOutOfMemory = 3, kFailed = 4;

// Memory that sanitizers may take: freed memory that they keep, red zones.
#ifdef PILESIM_SANITIZED
constexpr uint64_t kSanitizerMemory = uint64_t{512} << 20;
#else
constexpr uint64_t kSanitizerMemory = 0;
#endif

// Bytes of address space that this process has now.
uint64_t address_space() {
  uint64_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  return pages * static_cast<uint64_t>(sysconf(_SC_PAGESIZE));
}

void limit(int resource, uint64_t soft, uint64_t hard) {
  const rlimit value{.rlim_cur = soft, .rlim_max = hard};
  setrlimit(static_cast<__rlimit_resource>(resource), &value);
}

void prepare_child(const IsolationLimits& limits) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  // The child does not keep the parent's signal handlers.
  for (const int signal : {SIGHUP, SIGINT, SIGTERM, SIGSEGV, SIGBUS, SIGABRT, SIGFPE, SIGILL,
                           SIGXCPU, SIGPIPE, SIGALRM}) {
    std::signal(signal, SIG_DFL);
  }
  // A crash here is an answer, no incident: no dump, no last words.
  limit(RLIMIT_CORE, 0, 0);
  const int nowhere = open("/dev/null", O_RDWR | O_CLOEXEC);
  if (nowhere >= 0) {
    dup2(nowhere, STDOUT_FILENO);
    dup2(nowhere, STDERR_FILENO);
  }
  const auto cpu_s = static_cast<uint64_t>(limits.cpu_s);
  limit(RLIMIT_CPU, cpu_s, cpu_s + 1);
#ifdef PILESIM_SANITIZED
  __sanitizer_set_death_callback([] { _exit(kFailed); });
#endif
  rlimit before{};
  getrlimit(RLIMIT_AS, &before);
  const uint64_t most = address_space() + limits.memory_bytes + kSanitizerMemory;
  limit(RLIMIT_AS, std::min<uint64_t>(most, before.rlim_max), before.rlim_max);
}

[[noreturn]] void run_child(const std::function<std::string()>& work, const IsolationLimits& limits,
                            int output) {
  prepare_child(limits);
  try {
    const std::string bytes = work();
    for (size_t sent = 0; sent < bytes.size();) {
      const ssize_t count = write(output, bytes.data() + sent, bytes.size() - sent);
      if (count < 0 && errno == EINTR) continue;
      if (count < 0) _exit(kFailed);
      sent += static_cast<size_t>(count);
    }
  } catch (const std::bad_alloc&) {
    _exit(kOutOfMemory);
  } catch (...) {
    _exit(kFailed);
  }
  _exit(0);  // the caller's destructors and files are not the child's to end
}

std::string read_to_end(int descriptor) {
  std::string bytes;
  char buffer[65536];
  while (true) {
    const ssize_t count = read(descriptor, buffer, sizeof buffer);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return bytes;
    bytes.append(buffer, static_cast<size_t>(count));
  }
}

std::string fault_of(int status, const IsolationLimits& limits) {
  if (WIFEXITED(status)) {
    switch (WEXITSTATUS(status)) {
      case 0:
        return {};
      case kOutOfMemory:
        return "needs more than " + std::to_string(limits.memory_bytes >> 20) + " MB of memory";
      default:
        return "fails";
    }
  }
  const int signal = WTERMSIG(status);
  if (signal == SIGXCPU || signal == SIGKILL) {
    return "does not end within " + std::to_string(limits.cpu_s) + " s, or was killed";
  }
  return std::string("crashes (") + strsignal(signal) + ')';
}

}  // namespace

IsolatedResult run_isolated(const std::function<std::string()>& work,
                            const IsolationLimits& limits) {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) throw io_error("a pipe", "cannot be made", errno);
  const pid_t child = fork();
  if (child < 0) {
    const int fault = errno;
    close(ends[0]);
    close(ends[1]);
    throw io_error("a process", "cannot be started", fault);
  }
  if (child == 0) {
    close(ends[0]);
    run_child(work, limits, ends[1]);
  }
  close(ends[1]);
  IsolatedResult result;
  result.bytes = read_to_end(ends[0]);
  close(ends[0]);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  result.fault = fault_of(status, limits);
  if (!result.fault.empty()) result.bytes.clear();
  return result;
}

void allow_isolated_memory(uint64_t bytes) {
  rlimit now{};
  getrlimit(RLIMIT_AS, &now);
  if (now.rlim_cur == RLIM_INFINITY) return;
  limit(RLIMIT_AS, std::min<uint64_t>(now.rlim_cur + bytes, now.rlim_max), now.rlim_max);
}

bool isolation_counts_memory() {
#ifdef PILESIM_SANITIZED
  return false;
#else
  return true;
#endif
}

}  // namespace pilesim
