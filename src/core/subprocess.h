// Other programs (ffmpeg, gnuplot) run as child processes without a shell: text or pixels go into
// their stdin through a pipe, their output is kept.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace pilesim {

struct SubprocessResult {
  int exit_status = 0;             // 128 + the signal's number where a signal ended it
  std::string output;              // all of its stdout
  std::string errors;              // all of its stderr
  double processor_s = 0;          // of it and of the children that it has waited for
  uint64_t peak_memory_bytes = 0;  // of the largest of them
};

class Subprocess {
 public:
  // Starts argv[0], looked up in PATH, in a process group of its own, so that Ctrl-C reaches
  // pilesim only, which then ends the child in good order. Where pilesim is killed, or the thread
  // ends that started the child, the kernel kills the child. All that it prints is kept in memory:
  // ask talkative programs to be quiet. It works in `directory`, or where that is empty in this
  // process's own. Throws Error(io) where it cannot be started; if it is not installed, the message
  // names `debian_package`.
  Subprocess(const std::vector<std::string>& argv, const std::string& debian_package,
             const std::filesystem::path& directory = {});
  // Kills the child if wait() or finish() was not called.
  ~Subprocess();
  Subprocess(const Subprocess&) = delete;
  Subprocess& operator=(const Subprocess&) = delete;

  // Writes into the child's stdin; blocks while the child is busy. Throws Error(io) with the
  // child's last words where it stopped reading. Never raises SIGPIPE.
  void write(std::span<const std::byte> bytes);
  void write(std::string_view text);

  // Waits for the child's end for at most so long; true once it has ended. wait() is still to be
  // called.
  bool ends_within(double seconds);
  // SIGTERM, and SIGKILL. wait() is still to be called.
  void ask_to_end();
  void kill();

  // Ends the child's stdin and waits for its end. Call once.
  SubprocessResult wait();
  // wait(), then Error(io) with the child's last words unless its exit status is 0. Gives stdout.
  std::string finish();

 private:
  [[noreturn]] void fail(const SubprocessResult& result) const;

  std::string program_;
  pid_t child_ = -1;  // -1: reaped
  int input_ = -1;    // our end of its stdin
  int output_ = -1;   // memory files: unlike pipes they never fill up and block the child
  int errors_ = -1;
};

// Runs a program to its end with `input` on its stdin; throws as above, gives its stdout.
std::string run_program(const std::vector<std::string>& argv, const std::string& debian_package,
                        std::string_view input = {});

}  // namespace pilesim
