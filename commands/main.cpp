// pilesim: large piles of rigid objects, from a scene file to a moving picture.
// The subcommand table, and the only place that turns errors into text and exit codes.

#include <fcntl.h>
#include <pthread.h>
#include <sys/resource.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <new>
#include <sstream>
#include <string>
#include <system_error>

#include "core/error.h"
#include "core/printable.h"
#include "core/utf8.h"
#include "misuse.h"
#include "options.h"

namespace {

// Beside those of ErrorKind: no fault of anybody.
constexpr int kOutOfMemory = 7;

constexpr char kExamples[] = R"(
Examples:
  pilesim simulate presets/impulse/rabbits_in_a_crate.json -o out/crate
  pilesim render out/crate
  pilesim validate my_scene.json

Exit codes: 0 done, 2 usage, 3 invalid scene or input, 4 input or output failed, 5 quality gate not
met, 6 internal fault, 7 not enough memory, 130 interrupted.)";

// The next file to be opened would take the number of a standard stream that the caller closed, and
// what is printed would end up in it. Puts something there that can be neither read nor written.
void occupy_standard_streams() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (fcntl(stream, F_GETFD) >= 0) continue;
    static_cast<void>(open("/dev/null", stream == STDIN_FILENO ? O_WRONLY : O_RDONLY));
  }
}

// Printed text must have arrived: a full disk behind stdout is an error, too.
void require_printed() {
  errno = 0;
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return;
  if (errno == 0) {  // the cause was given to an earlier print: one more brings it back
    std::clearerr(stdout);
    std::puts("");
    std::fflush(stdout);
  }
  // A closed pipe, as of `| head`: ends as programs do that leave SIGPIPE alone.
  if (errno == EPIPE) {
    std::signal(SIGPIPE, SIG_DFL);
    raise(SIGPIPE);
  }
  throw pilesim::io_error("standard output", "cannot be written", errno != 0 ? errno : EIO);
}

// Each problem on a line of its own, and each line as that of an only one.
int fail(const pilesim::Error& error) {
  std::istringstream lines(error.what());
  for (std::string line; std::getline(lines, line);) {
    std::fprintf(stderr, "pilesim: %s\n", line.c_str());
  }
  return static_cast<int>(error.kind());
}

int out_of_memory() {
  std::fputs("pilesim: not enough memory, or a limit on it (ulimit -v)\n", stderr);
  return kOutOfMemory;
}

// Reports errors of the standard library for threads, files and memory that the system refuses.
int refused_by_system(const std::system_error& error) {
  const bool is_memory = error.code() == std::errc::not_enough_memory ||
                         error.code() == std::errc::resource_unavailable_try_again;
  if (!is_memory) {
    std::fprintf(stderr, "pilesim: the system refuses: %s\n",
                 pilesim::printable(error.what()).c_str());
    return static_cast<int>(pilesim::ErrorKind::io);
  }
  std::fputs("pilesim: not enough memory, or no more threads, or a limit on them (ulimit -v, -u)\n",
             stderr);
  return kOutOfMemory;
}

// Where an exception cannot reach main(), as in a thread or while another one is copied.
[[noreturn]] void end_with_a_word() {
  try {
    if (const std::exception_ptr thrown = std::current_exception()) std::rethrow_exception(thrown);
  } catch (const std::bad_alloc&) {
    std::_Exit(out_of_memory());
  } catch (const std::system_error& error) {
    std::_Exit(refused_by_system(error));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "pilesim: internal fault: %s\n", error.what());
  } catch (...) {
  }
  std::abort();
}

// All threads have as much of it as the first one, whatever the limit was when the process began.
void require_stack() {
  constexpr rlim_t kStack = rlim_t{8} << 20;
  rlimit limit{};
  getrlimit(RLIMIT_STACK, &limit);
  if (limit.rlim_cur < kStack) {
    limit.rlim_cur = std::min(kStack, limit.rlim_max);
    setrlimit(RLIMIT_STACK, &limit);
  }
  constexpr rlim_t kLeastStack = rlim_t{1} << 20;
  if (limit.rlim_cur < kLeastStack) {
    std::fprintf(stderr,
                 "pilesim: the stack is limited to %llu KiB; expected at least %llu. Raise it: "
                 "ulimit -s 8192\n",
                 static_cast<unsigned long long>(limit.rlim_cur >> 10),
                 static_cast<unsigned long long>(kLeastStack >> 10));
    std::exit(kOutOfMemory);
  }
  pthread_attr_t attributes;
  size_t size = 0;
  if (pthread_getattr_default_np(&attributes) != 0) return;
  pthread_attr_getstacksize(&attributes, &size);
  if (size < kStack) {
    pthread_attr_setstacksize(&attributes, kStack);
    pthread_setattr_default_np(&attributes);
  }
  pthread_attr_destroy(&attributes);
}

// Names go into scenes, stores and reports, which are UTF-8.
void require_utf8(int argc, char** argv) {
  const auto refuse = [](const std::string& what, const std::string& name) {
    throw pilesim::Error(pilesim::ErrorKind::usage,
                         pilesim::Problem{.found = what + " \"" + name + "\" is not UTF-8",
                                          .expected = "text in UTF-8",
                                          .remedy = "Give the file or directory another name"});
  };
  for (int i = 1; i < argc; ++i) {
    if (!pilesim::is_utf8(argv[i])) refuse("the argument", argv[i]);
  }
  std::error_code fault;
  const std::string here = std::filesystem::current_path(fault).string();
  if (!pilesim::is_utf8(here)) refuse("the directory", here);
}

int run(int argc, char** argv) {
  require_utf8(argc, argv);
  CLI::App app("Simulates and draws large piles of rigid objects.", "pilesim");
  app.set_version_flag("--version", "pilesim " PILESIM_VERSION "\nbuilt with GCC " __VERSION__
                                    " for x86-64-v3 (AVX2)" PILESIM_COMMIT);
  app.require_subcommand(1);
  app.footer(kExamples);
  pilesim::add_validate_command(app);
  pilesim::add_simulate_command(app);
  pilesim::add_direct_pile_command(app);
  pilesim::add_finish_command(app);
  pilesim::add_new_command(app);
  pilesim::add_render_command(app);
  pilesim::add_export_command(app);
  pilesim::add_view_command(app);
  pilesim::add_sample_signature_command(app);
  pilesim::add_fit_bspline_command(app);
  pilesim::add_inspect_command(app);
  pilesim::add_compare_command(app);
  pilesim::add_batch_command(app);
  pilesim::add_reproduce_command(app);
  pilesim::add_schema_command(app);
  pilesim::add_presets_command(app);
  pilesim::add_reference_command(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    const bool asked_for = error.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success);
    if (asked_for) {
      app.exit(error);
    } else {
      // The arguments that are wrong are in what it says.
      std::fprintf(stderr, "pilesim: %s\nRun with --help for more information.\n",
                   pilesim::printable(pilesim::misuse_text(app, error, argc, argv)).c_str());
      return static_cast<int>(pilesim::ErrorKind::usage);
    }
  }
  require_printed();
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  occupy_standard_streams();
  // Neither a reader of progress that goes away nor a limit on file sizes is to kill a run between
  // two writes: both become errors of the write.
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  std::set_terminate(end_with_a_word);
  try {
    require_stack();
    return run(argc, argv);
  } catch (const pilesim::Error& error) {
    return fail(error);
  } catch (const std::filesystem::filesystem_error& error) {
    return fail(pilesim::io_error(error.path1().string(), "cannot be used", error.code().value()));
  } catch (const std::bad_alloc&) {
    return out_of_memory();
  } catch (const std::system_error& error) {
    return refused_by_system(error);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "pilesim: internal fault: %s\n", pilesim::printable(error.what()).c_str());
  }
  return static_cast<int>(pilesim::ErrorKind::internal);
}
