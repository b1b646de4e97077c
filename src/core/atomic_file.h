// Output files appear whole or not at all: written beside their place, flushed, then renamed.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

namespace pilesim {

// Throws Error(io) and leaves the old file as it was when anything fails (a full disk, say).
// Survives kill -9 as "old or new"; not synced against power loss.
void write_file_atomically(const std::filesystem::path& path, std::span<const std::byte> bytes);
void write_file_atomically(const std::filesystem::path& path, std::string_view text);

// Appends all of `text` to an open file; `path` names it in the Error(io).
void write_all(int descriptor, const std::string& path, std::string_view text);

// The whole file; throws Error(io).
std::string read_file(const std::filesystem::path& path);

}  // namespace pilesim
