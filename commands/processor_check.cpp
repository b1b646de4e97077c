// Refuses, in words, a processor that lacks what all other code is compiled for. Runs before
// anything else of the program, and is itself compiled for any x86-64.
#include <unistd.h>

namespace {

constexpr char kRefusal[] =
    "pilesim: this processor lacks AVX2, FMA or BMI2; pilesim needs what x86-64-v3 names: Intel "
    "since Haswell (2013), AMD since Excavator (2015)\n";
constexpr int kExit = 6;

__attribute__((constructor(101))) void require_processor() {
  __builtin_cpu_init();
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
      __builtin_cpu_supports("bmi") && __builtin_cpu_supports("bmi2")) {
    return;
  }
  static_cast<void>(!write(STDERR_FILENO, kRefusal, sizeof kRefusal - 1));
  _exit(kExit);
}

}  // namespace
