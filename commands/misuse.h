// Messages about a command line that CLI11 cannot read.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace pilesim {

// The text of `error`, which parse() of `app` threw for these words: with what was meant, if the
// word is a command or an option that is not there.
std::string misuse_text(const CLI::App& app, const CLI::ParseError& error, int argc,
                        const char* const* argv);

}  // namespace pilesim
