// pilesim: large piles of rigid objects, from a scene file to a moving picture.
// The subcommand table, and the only place that turns errors into text and exit codes.

#include <fcntl.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <exception>
#include <filesystem>

#include "core/error.h"
#include "core/printable.h"
#include "misuse.h"
#include "options.h"

namespace {

constexpr char kExamples[] = R"(
Examples:
  pilesim simulate presets/impulse/rabbits_in_a_crate.json -o out/crate
  pilesim render out/crate
  pilesim validate my_scene.json

Exit codes: 0 done, 2 usage, 3 invalid scene or input, 4 input or output failed, 5 quality gate not
met, 6 internal fault, 130 interrupted.)";

// The next file to be opened would take the number of a standard stream that the caller closed, and
// what is printed would end up in it. Puts something there that can be neither read nor written.
void occupy_standard_streams() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (fcntl(stream, F_GETFD) >= 0) continue;
    static_cast<void>(open("/dev/null", stream == STDIN_FILENO ? O_WRONLY : O_RDONLY));
  }
}

// What was printed must have arrived: a full disk behind stdout is an error too.
void require_printed() {
  errno = 0;
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return;
  if (errno == 0) {  // the cause was given to an earlier print: one more brings it back
    std::clearerr(stdout);
    std::puts("");
    std::fflush(stdout);
  }
  // Of `| head`: ends as programs do that leave SIGPIPE alone.
  if (errno == EPIPE) {
    std::signal(SIGPIPE, SIG_DFL);
    raise(SIGPIPE);
  }
  throw pilesim::io_error("standard output", "cannot be written", errno != 0 ? errno : EIO);
}

int run(int argc, char** argv) {
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
      std::fprintf(stderr, "%s\nRun with --help for more information.\n",
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
  try {
    return run(argc, argv);
  } catch (const pilesim::Error& error) {
    std::fprintf(stderr, "pilesim: %s\n", error.what());
    return static_cast<int>(error.kind());
  } catch (const std::filesystem::filesystem_error& error) {
    const pilesim::Error fault =
        pilesim::io_error(error.path1().string(), "cannot be used", error.code().value());
    std::fprintf(stderr, "pilesim: %s\n", fault.what());
    return static_cast<int>(fault.kind());
  } catch (const std::bad_alloc&) {
    std::fputs("pilesim: not enough memory\n", stderr);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "pilesim: internal fault: %s\n", pilesim::printable(error.what()).c_str());
  }
  return static_cast<int>(pilesim::ErrorKind::internal);
}
