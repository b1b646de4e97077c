#include "core/subprocess.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cassert>
#include <cerrno>
#include <csignal>
#include <ctime>
#include <utility>

#include "core/error.h"

namespace pilesim {
namespace {

void close_once(int& descriptor) {
  if (descriptor >= 0) close(std::exchange(descriptor, -1));
}

std::string read_all(int descriptor) {
  std::string text;
  char buffer[65536];
  for (off_t offset = 0;;) {
    const ssize_t count = pread(descriptor, buffer, sizeof buffer, offset);
    if (count <= 0) return text;
    text.append(buffer, static_cast<size_t>(count));
    offset += count;
  }
}

// Keeps SIGPIPE from this thread while it lives, and swallows one that a write has raised.
class SigpipeGuard {
 public:
  SigpipeGuard() {
    sigemptyset(&sigpipe_);
    sigaddset(&sigpipe_, SIGPIPE);
    sigset_t pending;
    sigpending(&pending);
    was_pending_ = sigismember(&pending, SIGPIPE) == 1;
    pthread_sigmask(SIG_BLOCK, &sigpipe_, &old_);
  }
  ~SigpipeGuard() {
    const timespec now{};
    if (!was_pending_) {
      while (sigtimedwait(&sigpipe_, nullptr, &now) < 0 && errno == EINTR) {
      }
    }
    pthread_sigmask(SIG_SETMASK, &old_, nullptr);
  }
  SigpipeGuard(const SigpipeGuard&) = delete;
  SigpipeGuard& operator=(const SigpipeGuard&) = delete;

 private:
  sigset_t sigpipe_, old_;
  bool was_pending_;
};

// The child from fork() to exec(), by nothing but system calls: other threads of the parent may
// hold any lock. The error number of a failure goes into `fault`.
[[noreturn]] void become(char* const* arguments, const char* directory, const int (&streams)[3],
                         pid_t parent, int fault) {
  setpgid(0, 0);
  // Dies with the thread that started it, also of kill -9. The parent may have died already.
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(127);
  for (int i = 0; i < 3; ++i) dup2(streams[i], i);
  for (const int signal : {SIGPIPE, SIGINT, SIGTERM, SIGXFSZ}) std::signal(signal, SIG_DFL);
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  if (*directory == '\0' || chdir(directory) == 0) execvp(arguments[0], arguments);
  const int error = errno;
  while (write(fault, &error, sizeof error) < 0 && errno == EINTR) {
  }
  _exit(127);
}

// Not posix_spawn(), which cannot tie the child's life to its parent's. Gives the error number.
int spawn(pid_t& child, const std::vector<std::string>& argv, const std::string& directory,
          const int (&streams)[3]) {
  std::vector<char*> arguments;
  for (const std::string& argument : argv) arguments.push_back(const_cast<char*>(argument.c_str()));
  arguments.push_back(nullptr);

  int fault_ends[2];
  if (pipe2(fault_ends, O_CLOEXEC) != 0) return errno;
  const pid_t parent = getpid();
  // No handler of ours is to run in the child.
  sigset_t all, before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  child = fork();
  int fault = child < 0 ? errno : 0;
  if (child == 0) {
    become(arguments.data(), directory.c_str(), streams, parent, fault_ends[1]);
  }
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  close(fault_ends[1]);
  if (child > 0) {
    ssize_t count;  // none where exec() closed the pipe
    while ((count = read(fault_ends[0], &fault, sizeof fault)) < 0 && errno == EINTR) {
    }
    if (count > 0) {
      while (waitpid(child, nullptr, 0) < 0 && errno == EINTR) {
      }
      child = -1;
    }
  }
  close(fault_ends[0]);
  return fault;
}

// The last lines of a program's complaint: enough to tell why, short enough for one message.
std::string last_words(std::string text) {
  constexpr size_t kLongest = 500;
  while (!text.empty() && (text.back() == '\n' || text.back() == ' ')) text.pop_back();
  for (size_t at = 0; (at = text.find('\n', at)) != text.npos; at += 2) text.replace(at, 1, "; ");
  if (text.size() > kLongest) text = "... " + text.substr(text.size() - kLongest);
  return text;
}

}  // namespace

Subprocess::Subprocess(const std::vector<std::string>& argv, const std::string& debian_package,
                       const std::filesystem::path& directory)
    : program_(argv.at(0)) {
  int pipe_ends[2] = {-1, -1};
  output_ = memfd_create("stdout", MFD_CLOEXEC);
  errors_ = memfd_create("stderr", MFD_CLOEXEC);
  int fault = 0;
  if (output_ < 0 || errors_ < 0 || pipe2(pipe_ends, O_CLOEXEC) != 0) fault = errno;
  input_ = pipe_ends[1];
  if (fault == 0) fault = spawn(child_, argv, directory.string(), {pipe_ends[0], output_, errors_});
  close_once(pipe_ends[0]);
  if (fault == 0) return;
  for (int* descriptor : {&input_, &output_, &errors_}) close_once(*descriptor);
  if (fault == ENOENT) {
    throw Error(ErrorKind::io, Problem{.file = program_,
                                       .found = "this program is needed and not installed",
                                       .remedy = "Install it: apt install " + debian_package});
  }
  throw io_error(program_, "cannot be started", fault);
}

Subprocess::~Subprocess() {
  close_once(input_);
  if (child_ > 0) {
    ::kill(child_, SIGKILL);
    while (waitpid(child_, nullptr, 0) < 0 && errno == EINTR) {
    }
  }
  close_once(output_);
  close_once(errors_);
}

void Subprocess::write(std::span<const std::byte> bytes) {
  assert(input_ >= 0);
  const SigpipeGuard guard;
  while (!bytes.empty()) {
    const ssize_t written = ::write(input_, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0 && errno == EPIPE) fail(wait());
    if (written < 0) throw io_error(program_, "cannot be written to", errno);
    bytes = bytes.subspan(static_cast<size_t>(written));
  }
}

void Subprocess::write(std::string_view text) { write(std::as_bytes(std::span(text))); }

bool Subprocess::ends_within(double seconds) {
  assert(child_ > 0);
  constexpr double kPause = 0.005;  // s
  const timespec pause{.tv_sec = 0, .tv_nsec = static_cast<long>(1e9 * kPause)};
  for (double waited = 0;; waited += kPause) {
    siginfo_t info{};
    if (waitid(P_PID, static_cast<id_t>(child_), &info, WEXITED | WNOHANG | WNOWAIT) != 0 ||
        info.si_pid == child_) {
      return true;
    }
    if (waited >= seconds) return false;
    nanosleep(&pause, nullptr);
  }
}

void Subprocess::ask_to_end() {
  assert(child_ > 0);
  ::kill(child_, SIGTERM);
}

void Subprocess::kill() {
  assert(child_ > 0);
  ::kill(child_, SIGKILL);
}

SubprocessResult Subprocess::wait() {
  assert(child_ > 0);
  close_once(input_);
  int status = 0;
  rusage used{};
  while (wait4(child_, &status, 0, &used) < 0 && errno == EINTR) {
  }
  child_ = -1;
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return {.exit_status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status),
          .output = read_all(output_),
          .errors = read_all(errors_),
          .processor_s = seconds(used.ru_utime) + seconds(used.ru_stime),
          .peak_memory_bytes = uint64_t{1024} * static_cast<uint64_t>(used.ru_maxrss)};
}

std::string Subprocess::finish() {
  SubprocessResult result = wait();
  if (result.exit_status != 0) fail(result);
  return std::move(result.output);
}

void Subprocess::fail(const SubprocessResult& result) const {
  std::string found = result.exit_status == 0
                          ? "ended before it had read all of its input"
                          : "failed with exit status " + std::to_string(result.exit_status);
  const std::string words = last_words(result.errors);
  if (!words.empty()) found += ": " + words;
  throw Error(ErrorKind::io, Problem{.file = program_, .found = std::move(found)});
}

std::string run_program(const std::vector<std::string>& argv, const std::string& debian_package,
                        std::string_view input) {
  Subprocess process(argv, debian_package);
  process.write(input);
  return process.finish();
}

}  // namespace pilesim
