// The error thrown by an action.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "core/error.h"

namespace pilesim::test {

// Its text. The test fails if `action` throws none, or one of another kind.
template <class Action>
std::string error_text(const Action& action, ErrorKind kind) {
  try {
    action();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), kind) << error.what();
    return error.what();
  }
  ADD_FAILURE() << "no error was thrown";
  return {};
}

}  // namespace pilesim::test
