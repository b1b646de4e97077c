// The frames that --frames asks for.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace pilesim {

struct FrameRange {
  uint64_t first = 0;
  std::optional<uint64_t> last;  // none: to the end
  uint64_t step = 1;
};

// "7", "1-100", "30-" or "1-100x2". Throws CLI::ValidationError for anything else.
FrameRange parse_frame_range(const std::string& text);

// The frames of `range`, out of 0 .. count - 1. Throws CLI::ValidationError if the range goes
// beyond them and Error(input) if there are none.
std::vector<uint64_t> selected_frames(const FrameRange& range, uint64_t count);

}  // namespace pilesim
