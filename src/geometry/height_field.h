// Terrain from a grey picture.
#pragma once

#include <filesystem>

#include "geometry/mesh.h"

namespace pilesim {

inline constexpr int kLargestHeightField = 2048;  // pixels a side

// The surface over the picture's pixels, a vertex each: black at y = low_m, white at high_m, in
// steps of 1/65535 (of 8-bit pictures 1/255); `size_x_m` and `size_z_m` from the first pixel's
// centre to the last one's, about the origin. The picture's right is +x, its lower edge +z.
// Triangles face up. Colours count by their brightness. Throws Error(io), and Error(input) naming
// `png` for what is no PNG, or has less than 2 or more than kLargestHeightField pixels a side.
TriangleMesh height_field_mesh(const std::filesystem::path& png, double size_x_m, double size_z_m,
                               double low_m, double high_m);

}  // namespace pilesim
