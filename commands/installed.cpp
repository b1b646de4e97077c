#include "installed.h"

#include "core/error.h"

namespace pilesim {

namespace fs = std::filesystem;

fs::path installed_directory(const std::string& name) {
  const fs::path program = fs::read_symlink("/proc/self/exe").parent_path();
  for (const char* way : {"../share/pilesim", "../../.."}) {
    const fs::path directory = (program / way / name).lexically_normal();
    if (fs::is_directory(directory)) return directory;
  }
  throw Error(ErrorKind::io,
              Problem{.file = (program / "../share/pilesim" / name).lexically_normal().string(),
                      .found = "is not there",
                      .expected = "the " + name + ", beside the program",
                      .remedy = "Install pilesim as a whole"});
}

}  // namespace pilesim
