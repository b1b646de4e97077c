// Numbers of things in messages.
#pragma once

#include <string>

namespace pilesim {

// "1 frame", "2 frames"; "1 body", "2 bodies" with `many`, where an s does not make the plural.
inline std::string counted(unsigned long long count, const std::string& one,
                           const std::string& many = {}) {
  return std::to_string(count) + ' ' + (count == 1 ? one : many.empty() ? one + 's' : many);
}

}  // namespace pilesim
