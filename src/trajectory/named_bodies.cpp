#include "trajectory/named_bodies.h"

#include <fnmatch.h>

#include "core/error.h"

namespace pilesim {

std::vector<uint8_t> bodies_named(const std::vector<std::string>& patterns,
                                  const std::vector<std::string>& names,
                                  const std::string& option) {
  std::vector<uint8_t> chosen(names.size());
  for (const std::string& pattern : patterns) {
    bool fits = false;
    for (size_t i = 0; i < names.size(); ++i) {
      if (fnmatch(pattern.c_str(), names[i].c_str(), 0) != 0) continue;
      chosen[i] = 1;
      fits = true;
    }
    if (fits) continue;
    throw Error(ErrorKind::usage,
                Problem{.file = option + " " + pattern,
                        .found = "fits the name of no body",
                        .expected = names.empty() ? "a trajectory that has bodies"
                                                  : "a name such as " + names.back() +
                                                        ", or a pattern with * and ?",
                        .remedy = "Put patterns in quotes"});
  }
  return chosen;
}

}  // namespace pilesim
