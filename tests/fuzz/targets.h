// The readers of files, each as a function of arbitrary bytes. It gives a result or an Error;
// anything else (a crash, an assertion, another exception) is a bug. libFuzzer drives them
// (fuzz_main.cpp), and every test run goes through tests/fuzz/corpus (corpus_test.cpp).
#pragma once

#include <span>
#include <string_view>

namespace pilesim::fuzz {

struct Target {
  const char* name;  // also the name of its folder in the corpus
  void (*run)(std::string_view bytes);
};

// Targets that need only the formats themselves: built in a minute.
std::span<const Target> format_targets();
std::span<const Target> program_targets();

}  // namespace pilesim::fuzz
