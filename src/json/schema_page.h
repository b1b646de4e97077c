// The JSON Schema of codecs as a page for people.
#pragma once

#include <string>

#include "json/json_text.h"

namespace pilesim {

// Markdown: a table of keys for each kind of object in `schema`, a section each. `name`: of the
// outermost object.
std::string schema_page(const Json& schema, const std::string& name);

}  // namespace pilesim
