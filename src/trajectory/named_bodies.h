// Bodies chosen by their names on a command line.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace pilesim {

// 1 for each of `names` that one of the shell patterns fits (* and ? as usual), else 0. Throws
// Error(usage), naming `option`, for a pattern that fits no name.
std::vector<uint8_t> bodies_named(const std::vector<std::string>& patterns,
                                  const std::vector<std::string>& names, const std::string& option);

}  // namespace pilesim
