// When it is time for the next checkpoint: by the clock, which nothing that is computed depends on;
// after each step where the period is 0.
#pragma once

#include <algorithm>

#include "core/clock.h"

namespace pilesim {

class CheckpointPace {
 public:
  explicit CheckpointPace(double period_s) : period_s_(period_s) {}

  bool is_due() const {
    return period_s_ == 0 || since_.seconds() >= std::max(period_s_, took_s_ / kMostShare);
  }
  // `took_s`: that the last one took.
  void wrote(double took_s) {
    took_s_ = took_s;
    since_.restart();
  }

 private:
  // At most so large a part of the time goes into checkpoints.
  static constexpr double kMostShare = 0.015;

  double period_s_;
  double took_s_ = 0;
  Stopwatch since_;
};

}  // namespace pilesim
