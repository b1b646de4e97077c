#include "render/dataset/run_length.h"

namespace pilesim {

std::string compressed_runs(std::span<const uint32_t> runs) {
  constexpr int64_t kGroup = 0x1F, kSign = 0x10, kMore = 0x20;
  std::string text;
  for (size_t i = 0; i < runs.size(); ++i) {
    int64_t left = runs[i];
    if (i > 2) left -= runs[i - 2];
    for (bool more = true; more;) {
      const int64_t group = left & kGroup;
      left >>= 5;
      // The last group's highest bit is the sign of what follows it.
      more = left != ((group & kSign) != 0 ? -1 : 0);
      text += static_cast<char>('0' + (more ? group | kMore : group));
    }
  }
  return text;
}

}  // namespace pilesim
