// Reports problems of a JSON document by line and column.
#pragma once

#include <string>

#include "json/problem_log.h"

namespace pilesim {

// Throws Error(input) with all findings of `log` and all keys that are repeated in an object, in
// the order of the text; returns if there are none. `text` has passed parse_json().
void throw_findings(const ProblemLog& log, const std::string& text, const std::string& file);

}  // namespace pilesim
