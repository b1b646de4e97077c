// A libFuzzer program of the target PILESIM_FUZZ_TARGET, one of PILESIM_FUZZ_TARGETS().
#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "targets.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using pilesim::fuzz::Target;
  static const Target& target = *std::ranges::find(
      pilesim::fuzz::PILESIM_FUZZ_TARGETS(), std::string_view(PILESIM_FUZZ_TARGET), &Target::name);
  target.run({reinterpret_cast<const char*>(data), size});
  return 0;
}
