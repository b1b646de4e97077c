#include "core/progress.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <utility>

namespace pilesim {

Progress::Progress(ProgressMode mode, std::string label, uint64_t total, std::string unit)
    : mode_(mode),
      label_(std::move(label)),
      total_(std::max<uint64_t>(1, total)),
      unit_(std::move(unit)),
      start_(std::chrono::steady_clock::now()),
      last_draw_(start_) {
  if (mode_ == ProgressMode::automatic) {
    mode_ = isatty(STDERR_FILENO) != 0 ? ProgressMode::bar : ProgressMode::none;
  }
}

Progress::~Progress() { finish(); }

void Progress::update(uint64_t done) {
  done_ = done;
  if (mode_ == ProgressMode::none) return;
  const auto now = std::chrono::steady_clock::now();
  if (now - last_draw_ < std::chrono::milliseconds(100)) return;
  last_draw_ = now;
  draw(done);
}

void Progress::draw(uint64_t done) {
  drawn_ = true;
  const double elapsed_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  const double share = static_cast<double>(std::min(done, total_)) / static_cast<double>(total_);
  const double left_s = share > 0 ? elapsed_s * (1 - share) / share : 0;
  const auto count = static_cast<unsigned long long>(done);
  const auto total = static_cast<unsigned long long>(total_);
  if (mode_ == ProgressMode::json) {
    std::fprintf(stderr,
                 "{\"stage\":\"%s\",\"done\":%llu,\"total\":%llu,\"unit\":\"%s\","
                 "\"elapsed_s\":%.1f,\"left_s\":%.1f}\n",
                 label_.c_str(), count, total, unit_.c_str(), elapsed_s, left_s);
    return;
  }
  constexpr int kWidth = 30;
  const int filled = static_cast<int>(share * kWidth);
  const std::string bar = std::string(filled, '#') + std::string(kWidth - filled, '.');
  std::fprintf(stderr, "\r%s [%s] %llu/%llu %s, %.0f s, %.0f s left\033[K", label_.c_str(),
               bar.c_str(), count, total, unit_.c_str(), elapsed_s, left_s);
  std::fflush(stderr);
}

void Progress::finish() {
  if (mode_ == ProgressMode::none) return;
  if (drawn_ || mode_ == ProgressMode::json) draw(done_);
  if (drawn_ && mode_ == ProgressMode::bar) std::fputc('\n', stderr);
  mode_ = ProgressMode::none;
}

}  // namespace pilesim
