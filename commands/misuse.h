// Messages about a command line that CLI11 cannot read.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace pilesim {

// The text of `error`, which parse() of `app` threw for these words: with the nearest name, if the
// word is an unknown command or option.
std::string misuse_text(const CLI::App& app, const CLI::ParseError& error, int argc,
                        const char* const* argv);

}  // namespace pilesim
