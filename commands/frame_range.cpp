#include "frame_range.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <string_view>

#include "core/error.h"
#include "numbers.h"

namespace pilesim {

namespace {

bool take(char letter, std::string_view& text) {
  if (!text.starts_with(letter)) return false;
  text.remove_prefix(1);
  return true;
}

std::optional<FrameRange> read_range(std::string_view text) {
  FrameRange range;
  const std::optional<uint64_t> first = take_whole_number(text);
  if (!first) return std::nullopt;
  range.first = *first;
  if (text.empty()) {
    range.last = first;
    return range;
  }
  if (!take('-', text)) return std::nullopt;
  range.last = take_whole_number(text);
  if (take('x', text)) {
    const std::optional<uint64_t> step = take_whole_number(text);
    if (!step) return std::nullopt;
    range.step = *step;
  }
  const bool sound = range.step > 0 && range.last.value_or(range.first) >= range.first;
  return text.empty() && sound ? std::optional(range) : std::nullopt;
}

}  // namespace

FrameRange parse_frame_range(const std::string& text) {
  if (const std::optional<FrameRange> range = read_range(text)) return *range;
  throw CLI::ValidationError("--frames", "'" + text +
                                             "' is not FRAME, FIRST-LAST, FIRST- or one of the "
                                             "latter two with xSTEP");
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
  for (uint64_t frame = range.first;; frame += range.step) {
    frames.push_back(frame);
    if (last - frame < range.step) return frames;
  }
}

}  // namespace pilesim
