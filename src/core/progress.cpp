#include "core/progress.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <cstdlib>
#include <string_view>
#include <utility>

namespace pilesim {
namespace {

constexpr size_t kDefaultColumns = 80;
constexpr size_t kLongestBar = 30, kShortestBar = 5;

double share_of(const ProgressState& state) {
  return static_cast<double>(std::min(state.done, state.total)) / static_cast<double>(state.total);
}

double left_s(const ProgressState& state) {
  const double share = share_of(state);
  return share > 0 ? state.elapsed_s * (1 - share) / share : 0;
}

std::string whole_seconds(double seconds) {
  char text[40];
  std::snprintf(text, sizeof text, "%.0f s", seconds);
  return text;
}

}  // namespace

std::string progress_line(const std::string& label, const std::string& unit,
                          const ProgressState& state, size_t columns) {
  const std::string counts =
      std::to_string(state.done) + '/' + std::to_string(state.total) + ' ' + unit;
  const std::string left = whole_seconds(left_s(state)) + " left";
  const std::string times = counts + ", " + whole_seconds(state.elapsed_s) + ", " + left;
  const size_t around_bar = label.size() + times.size() + 4;
  if (columns >= around_bar + kShortestBar) {
    const size_t width = std::min(kLongestBar, columns - around_bar);
    const auto filled = static_cast<size_t>(share_of(state) * static_cast<double>(width));
    return label + " [" + std::string(filled, '#') + std::string(width - filled, '.') + "] " +
           times;
  }
  const std::string percent = std::to_string(static_cast<int>(100 * share_of(state))) + '%';
  for (const std::string& line :
       {label + ' ' + times, label + ' ' + counts + ", " + left,
        label + ' ' + percent + ", " + left, label + ' ' + percent, percent}) {
    if (line.size() <= columns) return line;
  }
  return percent.substr(0, columns);
}

size_t terminal_columns(int descriptor) {
  winsize size{};
  if (ioctl(descriptor, TIOCGWINSZ, &size) == 0 && size.ws_col > 0) return size.ws_col;
  const char* const variable = std::getenv("COLUMNS");
  const std::string_view text = variable != nullptr ? variable : "";
  size_t columns = 0;
  const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), columns);
  const bool is_number = fault == std::errc() && end == text.data() + text.size();
  return is_number && columns > 0 ? columns : kDefaultColumns;
}

Progress::Progress(ProgressMode mode, std::string label, uint64_t total, std::string unit,
                   std::function<Clock::time_point()> now)
    : mode_(mode),
      label_(std::move(label)),
      total_(std::max<uint64_t>(1, total)),
      unit_(std::move(unit)),
      now_(std::move(now)),
      start_(now_()),
      last_draw_(start_) {
  if (mode_ == ProgressMode::automatic) {
    mode_ = isatty(STDERR_FILENO) != 0 ? ProgressMode::bar : ProgressMode::none;
  }
}

Progress::~Progress() { finish(); }

void Progress::update(uint64_t done) {
  done_ = done;
  if (mode_ == ProgressMode::none) return;
  const Clock::time_point now = now_();
  if (now - last_draw_ < std::chrono::milliseconds(100)) return;
  last_draw_ = now;
  draw();
}

void Progress::draw() {
  drawn_ = true;
  const ProgressState state{done_, total_, std::chrono::duration<double>(now_() - start_).count()};
  if (mode_ == ProgressMode::json) {
    std::fprintf(stderr,
                 "{\"stage\":\"%s\",\"done\":%llu,\"total\":%llu,\"unit\":\"%s\","
                 "\"elapsed_s\":%.1f,\"left_s\":%.1f}\n",
                 label_.c_str(), static_cast<unsigned long long>(done_),
                 static_cast<unsigned long long>(total_), unit_.c_str(), state.elapsed_s,
                 left_s(state));
    return;
  }
  // The last column stays free: some terminals go to the next line with it. The window may change.
  const size_t columns = std::max<size_t>(2, terminal_columns(STDERR_FILENO)) - 1;
  std::fprintf(stderr, "\r%s\033[K", progress_line(label_, unit_, state, columns).c_str());
  std::fflush(stderr);
}

void Progress::finish() {
  if (mode_ == ProgressMode::none) return;
  if (drawn_ || mode_ == ProgressMode::json) draw();
  if (drawn_ && mode_ == ProgressMode::bar) std::fputc('\n', stderr);
  mode_ = ProgressMode::none;
}

}  // namespace pilesim
