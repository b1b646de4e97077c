#include "job/child_run.h"

#include <sstream>

#include "core/interrupt.h"

namespace pilesim {

SubprocessResult run_child(const std::vector<std::string>& command,
                           const std::filesystem::path& directory, const Problem& failed) {
  Subprocess process(command, "pilesim", directory);
  while (!interrupted() && !process.ends_within(0.05)) {
  }
  if (interrupted()) process.ask_to_end();  // once: it ends at once when it is asked again
  SubprocessResult result = process.wait();
  if (interrupted() || result.exit_status == 0) return result;
  const bool known = result.exit_status == static_cast<int>(ErrorKind::input) ||
                     result.exit_status == static_cast<int>(ErrorKind::io);
  std::vector<Problem> problems = {failed};
  std::istringstream errors(result.errors);
  for (std::string line; std::getline(errors, line);) problems.push_back({.found = line});
  throw Error(known ? static_cast<ErrorKind>(result.exit_status) : ErrorKind::internal,
              std::move(problems));
}

}  // namespace pilesim
