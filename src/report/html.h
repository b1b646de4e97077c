// What the pages of reports share.
#pragma once

#include <string>

namespace pilesim {

// Plain text as it stands in HTML.
std::string escaped(const std::string& text);

// A page that needs no other file; `title` and `body` are HTML.
std::string html_page(const std::string& title, const std::string& body);

}  // namespace pilesim
