// Numbers of things in messages.
#pragma once

#include <string>

namespace pilesim {

// "1 frame", "2 frames"; "1 body", "2 bodies" with `many`, where an s does not make the plural.
inline std::string counted(unsigned long long count, const std::string& one,
                           const std::string& many = {}) {
  return std::to_string(count) + ' ' + (count == 1 ? one : many.empty() ? one + 's' : many);
}

// "500 bodies, 1 static, 2 kinematic": bodies are those that move by forces, others stand apart.
inline std::string counted_bodies(unsigned long long dynamic, unsigned long long fixed,
                                  unsigned long long kinematic) {
  std::string text = counted(dynamic, "body", "bodies");
  if (fixed > 0) text += ", " + std::to_string(fixed) + " static";
  if (kinematic > 0) text += ", " + std::to_string(kinematic) + " kinematic";
  return text;
}

}  // namespace pilesim
