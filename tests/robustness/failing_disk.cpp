// Preloaded into pilesim: kills it, signals it, or fills its disk, at a chosen one of its changes
// to files. This tests every such point, whatever the machine's speed. From the environment:
//   FAILING_DISK_UNDER    absolute path of a directory: changes below it count
//   FAILING_DISK_NAME     only changes of paths with this ending count
//   FAILING_DISK_COMMAND  the affected subcommand of pilesim, since compare also runs simulate
//   FAILING_DISK_LOG      file that receives a line for each change: operation, path
//   FAILING_DISK_AT       number of the change, from 1; 0: none
//   FAILING_DISK_FAULT    kill: SIGKILL before this change, or after half the bytes of a write
//                         full: from this change on nothing can be stored; a write stores half of
//                         its bytes
//                         a number: this signal, before this change; at 0: as soon as the program
//                         handles it
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <climits>
#include <csignal>
#include <cstdarg>
#include <cstdlib>
#include <cstring>
#include <string>

namespace {

struct Plan {
  std::string under, name;
  long at = 0;
  bool kills = false;
  int signal = 0;  // 0: none
  int log = -1;
};

std::string variable(const char* name) {
  const char* const value = std::getenv(name);
  return value == nullptr ? "" : value;
}

// The words of this process's command line, each terminated by a zero byte.
bool is_meant(const std::string& command) {
  char words[4096];
  const int file = static_cast<int>(syscall(SYS_openat, AT_FDCWD, "/proc/self/cmdline", O_RDONLY));
  if (file < 0) return false;
  const long size = syscall(SYS_read, file, words, sizeof words - 1);
  syscall(SYS_close, file);
  if (size <= 0) return false;
  words[size] = '\0';
  return std::strlen(words) + 1 < static_cast<size_t>(size) &&
         command == words + std::strlen(words) + 1;
}

// Null: this process is not affected.
const Plan* plan() {
  static const Plan* const made = []() -> const Plan* {
    if (!is_meant(variable("FAILING_DISK_COMMAND"))) return nullptr;
    auto* plan = new Plan;
    plan->under = variable("FAILING_DISK_UNDER");
    plan->at = std::atol(variable("FAILING_DISK_AT").c_str());
    plan->name = variable("FAILING_DISK_NAME");
    plan->kills = variable("FAILING_DISK_FAULT") == "kill";
    plan->signal = std::atoi(variable("FAILING_DISK_FAULT").c_str());
    plan->log = static_cast<int>(syscall(SYS_openat, AT_FDCWD, variable("FAILING_DISK_LOG").c_str(),
                                         O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666));
    return plan;
  }();
  return made;
}

std::string absolute(int directory, const char* path) {
  if (path[0] == '/') return path;
  char base[PATH_MAX];
  const std::string link =
      directory == AT_FDCWD ? "/proc/self/cwd" : "/proc/self/fd/" + std::to_string(directory);
  const ssize_t size = readlink(link.c_str(), base, sizeof base);
  return size < 0 ? path : std::string(base, static_cast<size_t>(size)) + "/" + path;
}

std::string path_of(int descriptor) {
  char path[PATH_MAX];
  const ssize_t size =
      readlink(("/proc/self/fd/" + std::to_string(descriptor)).c_str(), path, sizeof path);
  return size < 0 ? "" : std::string(path, static_cast<size_t>(size));
}

enum class Verdict { pass, half, fail };

[[noreturn]] void die() {
  syscall(SYS_kill, getpid(), SIGKILL);
  for (;;) pause();
}

// Counts the change. `takes_room`: a full disk refuses it.
Verdict judge(const char* operation, const std::string& path, bool takes_room) {
  static std::atomic<long> count{0};
  const Plan* const p = plan();
  if (p == nullptr || !path.starts_with(p->under + "/") || !path.ends_with(p->name)) {
    return Verdict::pass;
  }
  const long number = ++count;
  const std::string line = std::string(operation) + " " + path + "\n";
  if (p->log >= 0) syscall(SYS_write, p->log, line.data(), line.size());
  if (p->at == 0 || number < p->at) return Verdict::pass;
  if (p->signal != 0) {
    if (number == p->at) raise(p->signal);
    return Verdict::pass;
  }
  const bool is_write = std::strcmp(operation, "write") == 0;
  if (p->kills) {
    if (!is_write) die();
    return Verdict::half;
  }
  if (!takes_room) return Verdict::pass;
  return is_write && number == p->at ? Verdict::half : Verdict::fail;
}

template <typename Function>
Function* next(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

// True: errno gives the reason for the refusal.
bool refused(const char* operation, const std::string& path, bool takes_room) {
  if (judge(operation, path, takes_room) != Verdict::fail) return false;
  errno = ENOSPC;
  return true;
}

bool open_is_refused(const char* path, int flags) {
  struct stat there;
  return (flags & O_CREAT) != 0 && stat(path, &there) != 0 &&
         refused("create", absolute(AT_FDCWD, path), true);
}

}  // namespace

extern "C" {

sighandler_t signal(int number, sighandler_t handler) {
  static std::atomic<bool> is_sent{false};
  static auto* const real = next<sighandler_t(int, sighandler_t)>("signal");
  const sighandler_t before = real(number, handler);
  const Plan* const p = plan();
  const bool handles = handler != SIG_DFL && handler != SIG_IGN;
  if (p != nullptr && p->at == 0 && p->signal == number && handles && !is_sent.exchange(true)) {
    raise(number);
  }
  return before;
}

int open(const char* path, int flags, ...) {
  va_list rest;
  va_start(rest, flags);
  const auto mode = (flags & O_CREAT) != 0 ? va_arg(rest, mode_t) : 0;
  va_end(rest);
  if (open_is_refused(path, flags)) return -1;
  static auto* const real = next<int(const char*, int, ...)>("open");
  return real(path, flags, mode);
}

int open64(const char* path, int flags, ...) {
  va_list rest;
  va_start(rest, flags);
  const auto mode = (flags & O_CREAT) != 0 ? va_arg(rest, mode_t) : 0;
  va_end(rest);
  if (open_is_refused(path, flags)) return -1;
  static auto* const real = next<int(const char*, int, ...)>("open64");
  return real(path, flags, mode);
}

ssize_t write(int descriptor, const void* bytes, size_t size) {
  static auto* const real = next<ssize_t(int, const void*, size_t)>("write");
  switch (judge("write", path_of(descriptor), true)) {
    case Verdict::pass:
      return real(descriptor, bytes, size);
    case Verdict::fail:
      errno = ENOSPC;
      return -1;
    case Verdict::half:
      break;
  }
  const ssize_t written = real(descriptor, bytes, size / 2);
  if (plan()->kills) die();
  if (written > 0) return written;
  errno = ENOSPC;
  return -1;
}

int mkdir(const char* path, mode_t mode) {
  struct stat there;
  if (stat(path, &there) != 0 && refused("mkdir", absolute(AT_FDCWD, path), true)) return -1;
  static auto* const real = next<int(const char*, mode_t)>("mkdir");
  return real(path, mode);
}

int rename(const char* from, const char* to) {
  judge("rename", absolute(AT_FDCWD, to), false);
  static auto* const real = next<int(const char*, const char*)>("rename");
  return real(from, to);
}

int unlink(const char* path) {
  judge("remove", absolute(AT_FDCWD, path), false);
  static auto* const real = next<int(const char*)>("unlink");
  return real(path);
}

int remove(const char* path) {
  judge("remove", absolute(AT_FDCWD, path), false);
  static auto* const real = next<int(const char*)>("remove");
  return real(path);
}

int unlinkat(int directory, const char* path, int flags) {
  judge("remove", absolute(directory, path), false);
  static auto* const real = next<int(int, const char*, int)>("unlinkat");
  return real(directory, path, flags);
}

}  // extern "C"
