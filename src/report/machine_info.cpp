#include "report/machine_info.h"

#include <sys/utsname.h>
#include <unistd.h>

#include <fstream>

#include "core/parallel_for.h"

namespace pilesim {
namespace {

// The text after the separator on the first line of `file` that starts with `key`.
std::string value_of(const char* file, const std::string& key, char separator) {
  std::ifstream stream(file);
  for (std::string line; std::getline(stream, line);) {
    if (!line.starts_with(key)) continue;
    const size_t at = line.find(separator);
    if (at == std::string::npos) continue;
    std::string value = line.substr(at + 1);
    while (!value.empty() && (value.front() == ' ' || value.front() == '"')) value.erase(0, 1);
    while (!value.empty() && value.back() == '"') value.pop_back();
    return value;
  }
  return "unknown";
}

}  // namespace

MachineInfo machine_info() {
  utsname kernel{};
  uname(&kernel);
  return {.cpu = value_of("/proc/cpuinfo", "model name", ':'),
          .cores = available_threads(),
          .memory_bytes = static_cast<uint64_t>(sysconf(_SC_PHYS_PAGES)) *
                          static_cast<uint64_t>(sysconf(_SC_PAGE_SIZE)),
          .system = value_of("/etc/os-release", "PRETTY_NAME", '=') + ", " + kernel.sysname + " " +
                    kernel.release,
          .version = PILESIM_VERSION,
          .compiler = "GCC " __VERSION__};
}

}  // namespace pilesim
