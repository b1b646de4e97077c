// Terrain from a grey picture.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>

#include "geometry/mesh.h"

namespace pilesim {

inline constexpr int kLargestHeightField = 2048;  // pixels a side

// The surface over the picture's pixels, a vertex each: black at y = low_m, white at high_m, in
// steps of 1/65535 (of 8-bit pictures 1/255); `size_x_m` and `size_z_m` from the first pixel's
// centre to the last one's, about the origin. The picture's right is +x, its lower edge +z.
// Triangles face up. Colours count by their brightness. Throws Error(io), and Error(input) naming
// `png` for a file that is no PNG, or has less than 2 or more than kLargestHeightField pixels a
// side.
TriangleMesh height_field_mesh(const std::filesystem::path& png, double size_x_m, double size_z_m,
                               double low_m, double high_m);

// Whether a mesh is such a surface: how many vertices its rows have, which run along x at even
// steps; 0: it is none.
uint32_t height_field_columns(const TriangleMesh& mesh);

// The triangles of a height field of so many `columns` that may come into `box` (frame of the
// mesh): visit(corners), row by row. It needs no tree.
template <typename Visit>
void for_each_triangle_near(const TriangleMesh& mesh, uint32_t columns, const Bounds& box,
                            const Visit& visit) {
  const auto rows = static_cast<uint32_t>(mesh.vertices.size() / columns);
  const Vec3 &first = mesh.vertices.front(), &last = mesh.vertices.back();
  // Whole cells, one more on either side for rounding.
  const auto cells = [&](int axis, uint32_t vertices) {
    const double cell = (last[axis] - first[axis]) / (vertices - 1);
    const auto place = [&](double at) {
      return std::clamp((at - first[axis]) / cell, -1.0, static_cast<double>(vertices));
    };
    const double from = std::floor(place(box.min()[axis])) - 1;
    const double to = std::floor(place(box.max()[axis])) + 1;
    return std::array{static_cast<uint32_t>(std::clamp(from, 0.0, vertices - 1.0)),
                      static_cast<uint32_t>(std::clamp(to + 1, 0.0, vertices - 1.0))};
  };
  const auto [first_column, end_column] = cells(0, columns);
  const auto [first_row, end_row] = cells(2, rows);
  for (uint32_t row = first_row; row < end_row; ++row) {
    for (uint32_t column = first_column; column < end_column; ++column) {
      const size_t cell = size_t{row} * (columns - 1) + column;
      for (size_t i = 2 * cell; i < 2 * cell + 2; ++i) {
        const auto& [a, b, c] = mesh.triangles[i];
        const std::array<Vec3, 3> corners = {mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]};
        const double low = std::min({corners[0].y(), corners[1].y(), corners[2].y()});
        const double high = std::max({corners[0].y(), corners[1].y(), corners[2].y()});
        if (low <= box.max().y() && high >= box.min().y()) visit(corners);
      }
    }
  }
}

}  // namespace pilesim
