#include "frame_range.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cmath>

#include "core/error.h"
#include "core/text.h"
#include "numbers.h"

namespace pilesim {

namespace {

bool take(std::string_view word, std::string_view& text) {
  if (!text.starts_with(word)) return false;
  text.remove_prefix(word.size());
  return true;
}

// "2.5s": digits with at most one point in between, and the unit.
std::optional<double> take_seconds(std::string_view& text) {
  const size_t end = text.find_first_not_of("0123456789.");
  if (end == text.npos || end == 0 || text[end] != 's') return std::nullopt;
  double seconds = 0;
  const char* const unit = text.data() + end;
  const auto [rest, fault] = std::from_chars(text.data(), unit, seconds, std::chars_format::fixed);
  if (fault != std::errc() || rest != unit) return std::nullopt;
  text.remove_prefix(end + 1);
  return seconds;
}

std::optional<FramePoint> take_point(std::string_view& text) {
  using Kind = FramePoint::Kind;
  if (take("last", text)) return FramePoint{.kind = Kind::from_end, .number = 1};
  if (const std::optional<double> time_s = take_seconds(text)) {
    return FramePoint{.kind = Kind::time, .time_s = *time_s};
  }
  const bool from_end = take("-", text);
  const std::optional<uint64_t> number = take_whole_number(text);
  if (!number || (from_end && *number == 0)) return std::nullopt;
  return FramePoint{.kind = from_end ? Kind::from_end : Kind::frame, .number = *number};
}

std::optional<FrameRange> read_range(std::string_view text) {
  FrameRange range;
  const std::optional<FramePoint> first = take_point(text);
  if (!first) return std::nullopt;
  range.first = *first;
  if (text.empty()) {
    range.last = first;
    return range;
  }
  if (!take("-", text)) return std::nullopt;
  if (!text.empty() && !text.starts_with('x')) {
    range.last = take_point(text);
    if (!range.last) return std::nullopt;
  }
  if (take("x", text)) {
    const std::optional<uint64_t> step = take_whole_number(text);
    if (!step) return std::nullopt;
    range.step = *step;
  }
  // Which of two points comes first is known of two frames, and of two times.
  const bool backwards = range.last && range.last->kind == FramePoint::Kind::frame &&
                         range.first.kind == FramePoint::Kind::frame &&
                         range.last->number < range.first.number;
  return text.empty() && range.step > 0 && !backwards ? std::optional(range) : std::nullopt;
}

CLI::ValidationError refusal(const std::string& option, const std::string& what) {
  return CLI::ValidationError(option, what);
}

uint64_t frame_of(const FramePoint& point, uint64_t count, double frame_rate,
                  const std::string& option) {
  const std::string frames = "0-" + std::to_string(count - 1) + ", the frames of the trajectory";
  switch (point.kind) {
    case FramePoint::Kind::frame:
      if (point.number < count) return point.number;
      throw refusal(option, std::to_string(point.number) + " is not within " + frames);
    case FramePoint::Kind::from_end:
      if (point.number <= count) return count - point.number;
      throw refusal(option, '-' + std::to_string(point.number) + " is before " + frames);
    case FramePoint::Kind::time: {
      const double frame = std::round(point.time_s * frame_rate);
      if (frame < static_cast<double>(count)) return static_cast<uint64_t>(frame);
      throw refusal(option, with_digits(point.time_s, 6) + "s is after " +
                                with_digits(static_cast<double>(count - 1) / frame_rate, 6) +
                                "s, the time of the last frame");
    }
  }
  return 0;
}

}  // namespace

FrameRange parse_frame_range(const std::string& text, const std::string& option) {
  if (const std::optional<FrameRange> range = read_range(text)) return *range;
  throw refusal(option, "'" + text + "' is not one of " + kFramesHelp);
}

std::vector<FrameRange> parse_frame_ranges(const std::string& text) {
  std::vector<FrameRange> ranges;
  for (size_t begin = 0, end = 0; end != text.npos; begin = end + 1) {
    end = text.find(',', begin);
    ranges.push_back(parse_frame_range(text.substr(begin, end - begin)));
  }
  return ranges;
}

FramePoint parse_frame_point(const std::string& text, const std::string& option) {
  std::string_view rest = text;
  const std::optional<FramePoint> point = take_point(rest);
  if (point && rest.empty()) return *point;
  throw refusal(option, "'" + text + "' is not a frame such as 7, last, -2 or 2.5s");
}

double parse_seconds(const std::string& text, const std::string& option) {
  constexpr double kMost_s = 3600;
  std::string_view rest = text;
  const std::optional<double> time_s = take_seconds(rest);
  if (time_s && rest.empty() && *time_s > 0 && *time_s <= kMost_s) return *time_s;
  throw refusal(option, "'" + text + "' is not a time such as 6s, above 0 and at most 3600s");
}

std::vector<uint64_t> selected_frames(const FrameRange& range, uint64_t count, double frame_rate,
                                      const std::string& option) {
  if (count == 0) {
    throw Error(ErrorKind::input, Problem{.found = "the trajectory holds no frames"});
  }
  const uint64_t first = frame_of(range.first, count, frame_rate, option);
  const uint64_t last = range.last ? frame_of(*range.last, count, frame_rate, option) : count - 1;
  if (last < first) {
    throw refusal(option, "frame " + std::to_string(last) + ", where it is to end, is before " +
                              std::to_string(first) + ", where it is to begin");
  }
  std::vector<uint64_t> frames;
  for (uint64_t frame = first;; frame += range.step) {
    frames.push_back(frame);
    if (last - frame < range.step) return frames;
  }
}

std::vector<uint64_t> selected_frames(const std::vector<FrameRange>& ranges, uint64_t count,
                                      double frame_rate) {
  std::vector<uint64_t> frames;
  for (const FrameRange& range : ranges) {
    const std::vector<uint64_t> more = selected_frames(range, count, frame_rate);
    frames.insert(frames.end(), more.begin(), more.end());
  }
  std::ranges::sort(frames);
  frames.erase(std::unique(frames.begin(), frames.end()), frames.end());
  return frames;
}

}  // namespace pilesim
