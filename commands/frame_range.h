// The frames that --frames asks for.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace pilesim {

// One frame of a trajectory whose length is not known yet.
struct FramePoint {
  enum class Kind : uint8_t { frame, from_end, time } kind = Kind::frame;
  uint64_t number = 0;  // frame: from 0; from_end: 1 is the last
  double time_s = 0;    // the nearest frame to it
};

struct FrameRange {
  FramePoint first;
  std::optional<FramePoint> last;  // none: to the end
  uint64_t step = 1;
};

inline constexpr const char* kFramesHelp =
    "7, 10-90, 10-, 10-90x2 (every second), last, -1 (the last, -2 the one before), times "
    "2.5s or 1s-2.5s";

// A point is N, last, -N or SECONDSs; a range is a point, POINT-POINT or POINT-, the latter two
// with xSTEP if wanted. Throws CLI::ValidationError naming `option` for anything else.
FrameRange parse_frame_range(const std::string& text, const std::string& option = "--frames");
// Several of them with commas in between; at least one.
std::vector<FrameRange> parse_frame_ranges(const std::string& text);
FramePoint parse_frame_point(const std::string& text, const std::string& option);
// A time above 0 and at most an hour: "6s". Throws CLI::ValidationError naming `option`.
double parse_seconds(const std::string& text, const std::string& option);

// The frames of `range`, out of 0 .. count - 1, `frame_rate` of them a second. Throws
// CLI::ValidationError if the range goes beyond them or backwards and Error(input) if there are
// none.
std::vector<uint64_t> selected_frames(const FrameRange& range, uint64_t count, double frame_rate,
                                      const std::string& option = "--frames");
// Those of all of them, ascending, each once.
std::vector<uint64_t> selected_frames(const std::vector<FrameRange>& ranges, uint64_t count,
                                      double frame_rate);

}  // namespace pilesim
