// Wall time by named stage. A step reads as its stages, each timed where it is called:
//   { StageTimer::Scope scope(timer, Stage::solver); solve(); }
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <string_view>

namespace pilesim {

enum class Stage { broad_phase, narrow_phase, solver, integration, output };
inline constexpr size_t kStageCount = 5;
std::string_view stage_name(Stage stage);

// Seconds by stage; `total` also includes time of no stage.
struct StageTimes {
  std::array<double, kStageCount> seconds{};
  double total_s = 0;

  double of(Stage stage) const { return seconds[static_cast<size_t>(stage)]; }
  // Time outside of all stages (>= 0 except for rounding).
  double other_s() const;
  StageTimes& operator+=(const StageTimes& more);

  static void fields(auto& self, auto& stream) { stream(self.seconds, self.total_s); }
};

class StageTimer {
 public:
  using Clock = std::chrono::steady_clock;

  // Adds its life time to one stage. Scopes do not nest.
  class Scope {
   public:
    Scope(StageTimer& timer, Stage stage) : timer_(timer), stage_(stage), start_(Clock::now()) {}
    ~Scope() {
      timer_.times_.seconds[static_cast<size_t>(stage_)] +=
          std::chrono::duration<double>(Clock::now() - start_).count();
    }
    Scope(const Scope&) = delete;
    Scope& operator=(const Scope&) = delete;

   private:
    StageTimer& timer_;
    Stage stage_;
    Clock::time_point start_;
  };

  // The times since the last call (or since construction); starts again.
  StageTimes take();

 private:
  StageTimes times_;
  Clock::time_point start_ = Clock::now();
};

}  // namespace pilesim
