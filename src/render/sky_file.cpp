#include "render/sky_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <string>
#include <string_view>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/printable.h"
#include "render/exr.h"

namespace pilesim {
namespace {

constexpr uint64_t kMostBytes = uint64_t{512} << 20;
constexpr int kWidest = 8192;  // pixels
// Sums over all directions stay finite.
constexpr float kBrightest = 1e9f;

[[noreturn]] void refuse(const std::filesystem::path& file, std::string found,
                         std::string expected) {
  throw Error(ErrorKind::input, Problem{.file = file.string(),
                                        .pointer = "/render/light/sky_file",
                                        .found = std::move(found),
                                        .expected = std::move(expected)});
}

void check_size(const std::filesystem::path& file, int64_t width, int64_t height) {
  if (width >= 2 && width <= kWidest && width == 2 * height) return;
  refuse(file, "has " + std::to_string(width) + " x " + std::to_string(height) + " pixels",
         "a picture of all directions, twice as wide as high, at most " + std::to_string(kWidest) +
             " pixels wide");
}

// The bytes of a Radiance file from its first one on.
class Radiance {
 public:
  Radiance(const std::filesystem::path& file, std::string_view bytes) : file_(file), left_(bytes) {}

  SkyImage read() {
    SkyImage image = header();
    std::vector<std::array<uint8_t, 4>> row(static_cast<size_t>(image.width));
    image.pixels.reserve(row.size() * static_cast<size_t>(image.height));
    for (int i = 0; i < image.height; ++i) {
      read_row(row);
      for (const auto& [red, green, blue, exponent] : row) {
        const float unit = exponent == 0 ? 0 : std::ldexp(1.0f, exponent - 128 - 8);
        image.pixels.emplace_back(unit * red, unit * green, unit * blue);
      }
    }
    return image;
  }

 private:
  [[noreturn]] void refuse_broken() const {
    refuse(file_, "is broken", "a whole Radiance picture");
  }

  std::string line() {
    const size_t end = left_.find('\n');
    constexpr size_t kLongest = 4096;
    if (end == left_.npos || end > kLongest) refuse_broken();
    std::string text(left_.substr(0, end));
    left_.remove_prefix(end + 1);
    return text;
  }

  SkyImage header() {
    if (!line().starts_with("#?")) refuse_broken();
    for (std::string text = line(); !text.empty(); text = line()) {
      if (text.starts_with("FORMAT=") && text != "FORMAT=32-bit_rle_rgbe") {
        refuse(file_, "has \"" + printable(text) + '"', "\"FORMAT=32-bit_rle_rgbe\"");
      }
    }
    const std::string size = line();
    int height = 0, width = 0, used = 0;
    if (std::sscanf(size.c_str(), "-Y %9d +X %9d%n", &height, &width, &used) != 2 ||
        static_cast<size_t>(used) != size.size()) {
      refuse(file_, "has the order of pixels \"" + printable(size) + '"', "\"-Y HEIGHT +X WIDTH\"");
    }
    check_size(file_, width, height);
    // Each run is of two bytes and of 127 equal ones at most.
    const auto least = static_cast<uint64_t>(height) * 8 * (static_cast<uint64_t>(width) / 127);
    if (left_.size() < least) refuse_broken();
    return {.width = width, .height = height, .pixels = {}};
  }

  uint8_t byte() {
    if (left_.empty()) refuse_broken();
    const auto value = static_cast<uint8_t>(left_.front());
    left_.remove_prefix(1);
    return value;
  }

  void read_row(std::vector<std::array<uint8_t, 4>>& row) {
    std::array<uint8_t, 4> first;
    for (uint8_t& value : first) value = byte();
    const bool has_runs = first[0] == 2 && first[1] == 2 && first[2] < 128;
    if (!has_runs) {
      row[0] = first;
      for (size_t i = 1; i < row.size(); ++i) {
        for (uint8_t& value : row[i]) value = byte();
      }
      return;
    }
    if (first[2] * size_t{256} + first[3] != row.size()) refuse_broken();
    for (size_t channel = 0; channel < 4; ++channel) {
      for (size_t i = 0; i < row.size();) {
        const uint8_t code = byte();
        const size_t count = code > 128 ? code - size_t{128} : code;
        if (count == 0 || count > row.size() - i) refuse_broken();
        const bool repeats = code > 128;
        const uint8_t value = repeats ? byte() : uint8_t{0};
        for (const size_t end = i + count; i < end; ++i) row[i][channel] = repeats ? value : byte();
      }
    }
  }

  const std::filesystem::path& file_;
  std::string_view left_;
};

SkyImage exr_sky(const std::filesystem::path& file, const std::string& bytes) {
  ExrColours colours;
  try {
    colours = read_exr_colours(
        bytes, [&](int64_t width, int64_t height) { check_size(file, width, height); });
  } catch (const UnreadableExr& fault) {
    refuse(file, fault.what(), "an OpenEXR picture with the channels R, G and B");
  }
  SkyImage image{.width = colours.width, .height = colours.height, .pixels = {}};
  image.pixels.reserve(colours.rgb.size() / 3);
  for (size_t i = 0; i < colours.rgb.size(); i += 3) {
    image.pixels.emplace_back(colours.rgb[i], colours.rgb[i + 1], colours.rgb[i + 2]);
  }
  return image;
}

}  // namespace

SkyImage read_sky(const std::filesystem::path& file) {
  const std::string bytes = read_file(file, kMostBytes);
  SkyImage image;
  if (bytes.starts_with("#?")) {
    image = Radiance(file, bytes).read();
  } else if (bytes.starts_with("\x76\x2f\x31\x01")) {
    image = exr_sky(file, bytes);
  } else {
    refuse(file, "is neither a Radiance nor an OpenEXR picture",
           "a file that .hdr or .exr stands for");
  }
  for (Vec3f& pixel : image.pixels) {
    for (float& value : pixel) value = value > 0 ? std::min(value, kBrightest) : 0;
  }
  return image;
}

}  // namespace pilesim
