// Progress of long work, on stderr.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <string>

namespace pilesim {

// automatic: a bar where stderr is a terminal, nothing elsewhere. json: one object a line.
enum class ProgressMode { automatic, bar, json, none };

struct ProgressState {
  uint64_t done = 0;
  uint64_t total = 1;  // > 0
  double elapsed_s = 0;
};

// "simulate [####......] 12/30 frames, 4 s, 6 s left" in at most `columns` >= 1 columns: where it
// is narrow, with a shorter bar, then without it, then without times. `label` and `unit` are ASCII.
std::string progress_line(const std::string& label, const std::string& unit,
                          const ProgressState& state, size_t columns);

// The width of the terminal behind `descriptor`; where it does not tell, COLUMNS of the
// environment, else 80.
size_t terminal_columns(int descriptor);

class Progress {
 public:
  using Clock = std::chrono::steady_clock;

  // `total` > 0 units of work, called `unit` ("frames"). `now` is for tests.
  Progress(ProgressMode mode, std::string label, uint64_t total, std::string unit,
           std::function<Clock::time_point()> now = Clock::now);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  // `done` units of `total` are complete. Cheap: draws at most ten times a second.
  void update(uint64_t done);
  // Ends the line. Called by the destructor if not before.
  void finish();

 private:
  void draw();

  ProgressMode mode_;
  std::string label_;
  uint64_t total_;
  std::string unit_;
  uint64_t done_ = 0;
  bool drawn_ = false;
  std::function<Clock::time_point()> now_;
  Clock::time_point start_;
  Clock::time_point last_draw_;
};

}  // namespace pilesim
