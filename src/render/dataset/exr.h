// OpenEXR files of numbers. OpenEXR is behind this interface and nowhere else.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <variant>
#include <vector>

namespace pilesim {

// A channel of one number a pixel, rows from top to bottom. The part before the last point of its
// name is its layer.
struct ExrChannel {
  std::string name;
  std::variant<const float*, const uint32_t*> values;
  size_t stride = 1;  // values from one pixel to the next
};

// The bytes of such a file, compressed without loss (ZIP). `file` is named in faults.
std::string exr_bytes(const std::filesystem::path& file, int width, int height,
                      const std::vector<ExrChannel>& channels);

// Compressed without loss (ZIP). Written beside its place and renamed. Throws Error(io).
void write_exr(const std::filesystem::path& file, int width, int height,
               const std::vector<ExrChannel>& channels);

}  // namespace pilesim
