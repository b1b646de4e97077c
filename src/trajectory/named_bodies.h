// Selects bodies by name on a command line.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace pilesim {

// 1 for each of `names` that matches one of the shell patterns (* and ?), else 0. Throws
// Error(usage) that names `option` for a pattern without a match.
std::vector<uint8_t> bodies_named(const std::vector<std::string>& patterns,
                                  const std::vector<std::string>& names, const std::string& option);

}  // namespace pilesim
