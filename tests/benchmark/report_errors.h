// Reports errors of the programs in this folder: one line on stderr, and exit code 1.
#pragma once

#include <cstdio>

#include "core/error.h"

namespace pilesim {

template <class Run>
int report_errors(const Run& run) {
  try {
    run();
    return 0;
  } catch (const Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}

}  // namespace pilesim
