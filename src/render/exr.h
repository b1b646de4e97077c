// OpenEXR files of numbers. OpenEXR is behind this interface and nowhere else.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <stdexcept>
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

// Why bytes are no picture that can be read.
struct UnreadableExr : std::runtime_error {
  using std::runtime_error::runtime_error;
};
struct ExrColours {
  int width = 0, height = 0;
  std::vector<float> rgb;  // (height, width, 3), as stored: any numbers
};
// The channels R, G and B of a picture in one part. `check_size` is called before any pixel is
// decoded, and may throw. Throws UnreadableExr.
ExrColours read_exr_colours(const std::string& bytes,
                            const std::function<void(int64_t width, int64_t height)>& check_size);

}  // namespace pilesim
