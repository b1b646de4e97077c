#include "frame_range.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <regex>

#include "core/error.h"

namespace pilesim {

FrameRange parse_frame_range(const std::string& text) {
  static const std::regex kRange(R"((\d{1,9})(-(\d{1,9})?(x(\d{1,9}))?)?)");
  std::smatch part;
  const bool is_range = std::regex_match(text, part, kRange);
  FrameRange range;
  if (is_range) {
    range.first = std::stoull(part[1]);
    if (!part[2].matched) range.last = range.first;
    if (part[3].matched) range.last = std::stoull(part[3]);
    if (part[5].matched) range.step = std::stoull(part[5]);
  }
  if (!is_range || range.step == 0 || range.last.value_or(range.first) < range.first) {
    throw CLI::ValidationError("--frames", "'" + text +
                                               "' is not FRAME, FIRST-LAST, FIRST- or one of the "
                                               "latter two with xSTEP");
  }
  return range;
}

std::vector<uint64_t> selected_frames(const FrameRange& range, uint64_t count) {
  if (count == 0) {
    throw Error(ErrorKind::input, Problem{.found = "the trajectory holds no frames"});
  }
  const uint64_t last = range.last.value_or(count - 1);
  if (range.first >= count || last >= count) {
    throw CLI::ValidationError("--frames", std::to_string(std::max(range.first, last)) +
                                               " is not within 0-" + std::to_string(count - 1) +
                                               ", the frames of the trajectory");
  }
  std::vector<uint64_t> frames;
  for (uint64_t frame = range.first; frame <= last; frame += range.step) frames.push_back(frame);
  return frames;
}

}  // namespace pilesim
