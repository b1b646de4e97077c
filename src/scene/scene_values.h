// Values of a scene file that stand for others: variables, and random ones.
#pragma once

#include <cstddef>
#include <map>
#include <string>

#include "json/json_text.h"
#include "json/problem_log.h"

namespace pilesim {

// The most bytes of variables in all places where they are used: a small file must not become a
// scene that no memory holds.
inline constexpr size_t kMostVariableBytes = size_t{64} << 20;

// Puts in place of each {"var": NAME} the value that "variables" has for the name, and in place of
// each {"random": ...} one drawn by the document's seed and the value's pointer: it depends on no
// other value. Variables may be drawn, and are the same wherever they are used; they name no other
// variables. Then takes "variables" away. Reports names that are unknown and draws that are not
// {"from", "to"} or {"of"}, and variables that take more
// than kMostVariableBytes; wrong values stay as they are. Returns the pointers where a variable was
// put, with its name.
std::map<std::string, std::string> resolve_values(Json& document, ProblemLog& log);

// The schema of the two, and one that takes these two in place of any value that `schema`
// describes.
Json stand_in_schema();
Json with_stand_ins(Json schema);

}  // namespace pilesim
