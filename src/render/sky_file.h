// Pictures of the sky in all directions, as cameras and painters keep them: Radiance (.hdr) and
// OpenEXR (.exr).
#pragma once

#include <filesystem>
#include <vector>

#include "core/types.h"

namespace pilesim {

// Rows from the zenith to the nadir, each once around, clockwise as seen from above.
struct SkyImage {
  int width = 0, height = 0;  // width = 2 height
  std::vector<Vec3f> pixels;  // (height, width) linear RGB, finite, >= 0
};

// Throws Error(input) with the file where it is no such picture, is too large or is broken, and
// Error(io) where it cannot be read. Values that are negative or not finite become 0.
SkyImage read_sky(const std::filesystem::path& file);

}  // namespace pilesim
