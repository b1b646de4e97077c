// The font that is part of the program, so that letters are the same everywhere: DejaVu Sans.
#pragma once

#include <string_view>

namespace pilesim {

std::string_view default_font();  // the bytes of its file

}  // namespace pilesim
