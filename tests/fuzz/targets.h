// The readers of files, each as a function of any bytes: it gives a result or an Error, and
// whatever else happens (a crash, an assertion, another exception) is a fault. libFuzzer drives
// them (fuzz_main.cpp) and every run of the tests goes through tests/fuzz/corpus (corpus_test.cpp).
#pragma once

#include <span>
#include <string_view>

namespace pilesim::fuzz {

struct Target {
  const char* name;  // of its folder in the corpus, too
  void (*run)(std::string_view bytes);
};

// Those that need no more of the program than the formats themselves: built in a minute.
std::span<const Target> format_targets();
std::span<const Target> program_targets();

}  // namespace pilesim::fuzz
