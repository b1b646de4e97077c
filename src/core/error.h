// The one exception type for faults of the user and of the machine. Faults of the programmer are
// asserts. Only commands/main.cpp catches it and turns it into text and an exit code.
#pragma once

#include <exception>
#include <string>
#include <vector>

namespace pilesim {

// The values are the process's exit codes.
enum class ErrorKind {
  usage = 2,          // command line
  input = 3,          // a scene, mesh or other input is invalid
  io = 4,             // a file cannot be read or written
  quality = 5,        // a quality gate was not met
  internal = 6,       // a fault of pilesim
  interrupted = 130,  // Ctrl-C; all that was computed is safe on disk
};

// One thing that is wrong. Empty strings and zeros mean "does not apply" and are not printed.
struct Problem {
  std::string file;
  std::string pointer;   // JSON pointer (RFC 6901) inside `file`
  int line = 0;          // from 1
  int column = 0;        // from 1
  std::string found;     // the fault: "density_kg_m3 is -3"
  std::string expected;  // the right value: "a number above 0"
  std::string remedy;    // how to mend it
};

// "scene.json:12:7: /materials/wood/density_kg_m3: is -3; expected a number above 0. Remedy." In
// one line, safe to show on a terminal; parts of more than 1,000 bytes are cut.
std::string to_string(const Problem& problem);

class Error : public std::exception {
 public:
  Error(ErrorKind kind, std::vector<Problem> problems);
  Error(ErrorKind kind, Problem problem);

  ErrorKind kind() const { return kind_; }
  const std::vector<Problem>& problems() const { return problems_; }
  // The problems, one a line: the first 50, and how many more there are.
  const char* what() const noexcept override { return text_.c_str(); }

 private:
  ErrorKind kind_;
  std::vector<Problem> problems_;
  std::string text_;
};

// io error for `path` with the system's reason (strerror of `error_number`, usually errno).
Error io_error(const std::string& path, const std::string& action, int error_number);

// `error` with `file` in all its problems that name none.
Error in_file(const Error& error, const std::string& file);

}  // namespace pilesim
