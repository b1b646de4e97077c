// Output files appear whole or not at all: written beside their place, flushed, then renamed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>

namespace pilesim {

// Throws Error(io) and leaves the old file as it was when anything fails (a full disk, say).
// Survives kill -9 as "old or new"; not synced against power loss.
void write_file_atomically(const std::filesystem::path& path, std::span<const std::byte> bytes);
void write_file_atomically(const std::filesystem::path& path, std::string_view text);
// One after the other.
void write_parts_atomically(const std::filesystem::path& path,
                            std::initializer_list<std::span<const std::byte>> parts);

// Appends all of `text` to an open file; `path` names it in the Error(io).
void write_all(int descriptor, const std::string& path, std::string_view text);

// No input is larger. So the size of a file on disk bounds the memory that it takes.
inline constexpr uint64_t kMostFileBytes = uint64_t{4} << 30;

// The whole file, which must be a regular one: devices and pipes have no size to be held to. Throws
// Error(io) where it cannot be read, and Error(input) where it has more than `most_bytes`, before
// any of it is.
std::string read_file(const std::filesystem::path& path, uint64_t most_bytes = kMostFileBytes);

}  // namespace pilesim
