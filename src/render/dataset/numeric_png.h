// Numbers as PNG files: grey of 8 or 16 bits, and colours of 16 bits.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>

namespace pilesim {

// `values` (height, width); or (height, width, 3) where there are three times as many. Rows from
// top to bottom. Throws Error(io).
void write_png8(const std::filesystem::path& file, int width, int height,
                std::span<const uint8_t> values);
void write_png16(const std::filesystem::path& file, int width, int height,
                 std::span<const uint16_t> values);

}  // namespace pilesim
