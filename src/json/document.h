// Problems of a JSON document, by line and column.
#pragma once

#include <string>

#include "json/problem_log.h"

namespace pilesim {

// Throws Error(input) with all findings of `log` and all keys that `text` has twice in an object,
// in the order of the text; returns where there are none. `text` is what parse_json() has accepted.
void throw_findings(const ProblemLog& log, const std::string& text, const std::string& file);

}  // namespace pilesim
