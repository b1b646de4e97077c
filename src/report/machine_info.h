// The machine and the build on which figures were measured.
#pragma once

#include <cstdint>
#include <string>

namespace pilesim {

struct MachineInfo {
  std::string cpu;
  int cores = 0;  // available to this process
  uint64_t memory_bytes = 0;
  std::string system;   // "Debian GNU/Linux 12 (bookworm), Linux 6.1.0"
  std::string version;  // of pilesim
  std::string compiler;
};

MachineInfo machine_info();

}  // namespace pilesim
