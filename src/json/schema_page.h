// Prints the JSON Schema of codecs as a page for people.
#pragma once

#include <string>

#include "json/json_text.h"

namespace pilesim {

// Markdown with one section and table of keys per kind of object in `schema`. `name` is that of the
// outermost object.
std::string schema_page(const Json& schema, const std::string& name);

}  // namespace pilesim
