// The one way in which commands write text for people: names from scenes and meshes are in it, and
// a terminal obeys their control characters.
#pragma once

#include <string>

namespace pilesim {

// To stdout, as printf() does, with control characters other than line feeds shown as escapes.
[[gnu::format(printf, 1, 2)]] void print(const char* format, ...);
// `text` as one line to stdout.
void print_line(const std::string& text);
// "pilesim: warning: `text`" as one line to stderr.
void warn(const std::string& text);

}  // namespace pilesim
