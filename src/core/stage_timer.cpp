#include "core/stage_timer.h"

#include <utility>

namespace pilesim {

std::string_view stage_name(Stage stage) {
  constexpr std::array<std::string_view, kStageCount> kNames = {"broad_phase", "narrow_phase",
                                                                "solver", "integration", "output"};
  return kNames[static_cast<size_t>(stage)];
}

double StageTimes::other_s() const {
  double claimed_s = 0;
  for (const double s : seconds) claimed_s += s;
  return total_s - claimed_s;
}

StageTimes& StageTimes::operator+=(const StageTimes& more) {
  for (size_t i = 0; i < kStageCount; ++i) seconds[i] += more.seconds[i];
  total_s += more.total_s;
  return *this;
}

StageTimes StageTimer::take() {
  const Clock::time_point now = Clock::now();
  times_.total_s = std::chrono::duration<double>(now - start_).count();
  start_ = now;
  return std::exchange(times_, {});
}

}  // namespace pilesim
