// Text from files and users made safe to show: a terminal acts on control characters, and letters
// that turn the direction of writing make a line read as another one.
#pragma once

#include <string>
#include <string_view>

namespace pilesim {

// `text` with control characters (C0, DEL, C1, line and paragraph separators) and marks of
// direction as "\u001b", bytes that are no UTF-8 as "\x9b". All else stays as it is, so that it may
// be applied twice; inside strings of JSON text of valid UTF-8 it keeps their meaning.
std::string printable(std::string_view text);
// The same, but keeps line feeds.
std::string printable_lines(std::string_view text);

// `text` as one word of a shell's command line: as it is, or in single quotes where it needs them.
std::string shell_word(std::string_view text);

// `text` cut after at most `length` bytes, not inside a character, with "..." for the missing rest.
std::string shortened(std::string_view text, size_t length);

}  // namespace pilesim
