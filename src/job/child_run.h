// pilesim as a child process, so that a run's memory and faults are its own.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/subprocess.h"

namespace pilesim {

// Runs `command`, whose first word is the program, in `directory` (empty: this process's own).
// After Ctrl-C it asks the child to end and returns: ask interrupted(). Else throws where the exit
// code is not 0: `failed`, and below it what the child says.
SubprocessResult run_child(const std::vector<std::string>& command,
                           const std::filesystem::path& directory, const Problem& failed);

}  // namespace pilesim
