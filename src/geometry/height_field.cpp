#include "geometry/height_field.h"

#include <cstdint>
#include <memory>
#include <string>

#include "core/atomic_file.h"
#include "core/error.h"
#include "geometry/png_chunks.h"

#define STB_IMAGE_STATIC
#define STBI_ONLY_PNG
#define STBI_NO_STDIO
#define STB_IMAGE_IMPLEMENTATION
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#include <stb/stb_image.h>
#pragma GCC diagnostic pop

namespace pilesim {
namespace {

constexpr uint64_t kMostPngBytes = uint64_t{256} << 20;
constexpr double kWhite = 65535;

struct FreePixels {
  void operator()(stbi_us* pixels) const { stbi_image_free(pixels); }
};

Error refusal(const std::filesystem::path& png, std::string found) {
  return {ErrorKind::input,
          Problem{.file = png.string(),
                  .found = std::move(found),
                  .expected = "a PNG of 2 to " + std::to_string(kLargestHeightField) +
                              " pixels a side, grey"}};
}

}  // namespace

TriangleMesh height_field_mesh(const std::filesystem::path& png, double size_x_m, double size_z_m,
                               double low_m, double high_m) {
  const std::string bytes = read_file(png, kMostPngBytes);
  const auto* data = reinterpret_cast<const stbi_uc*>(bytes.data());
  const auto length = static_cast<int>(bytes.size());
  int columns = 0, rows = 0, channels = 0;
  if (stbi_info_from_memory(data, length, &columns, &rows, &channels) == 0) {
    throw refusal(png, "is no PNG");
  }
  if (std::min(columns, rows) < 2 || std::max(columns, rows) > kLargestHeightField) {
    throw refusal(png, "has " + std::to_string(columns) + " x " + std::to_string(rows) + " pixels");
  }
  if (const std::string fault = png_fault(bytes); !fault.empty()) throw refusal(png, fault);
  const std::unique_ptr<stbi_us, FreePixels> pixels(
      stbi_load_16_from_memory(data, length, &columns, &rows, &channels, 1));
  if (!pixels) throw refusal(png, "is broken");
  TriangleMesh mesh;
  mesh.vertices.reserve(static_cast<size_t>(columns) * rows);
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const double share = pixels.get()[static_cast<size_t>(row) * columns + column] / kWhite;
      mesh.vertices.emplace_back((static_cast<double>(column) / (columns - 1) - 0.5) * size_x_m,
                                 low_m + share * (high_m - low_m),
                                 (static_cast<double>(row) / (rows - 1) - 0.5) * size_z_m);
    }
  }
  mesh.triangles.reserve(2 * static_cast<size_t>(columns - 1) * (rows - 1));
  for (int row = 0; row + 1 < rows; ++row) {
    for (int column = 0; column + 1 < columns; ++column) {
      const auto corner = static_cast<uint32_t>(row * columns + column);
      const auto below = corner + static_cast<uint32_t>(columns);
      mesh.triangles.push_back({corner, below, corner + 1});
      mesh.triangles.push_back({corner + 1, below, below + 1});
    }
  }
  return mesh;
}

uint32_t height_field_columns(const TriangleMesh& mesh) {
  if (mesh.triangles.empty() || mesh.triangles.front()[0] != 0) return 0;
  const uint32_t columns = mesh.triangles.front()[1];
  if (columns < 2 || mesh.vertices.size() % columns != 0) return 0;
  const auto rows = static_cast<uint32_t>(mesh.vertices.size() / columns);
  if (rows < 2 || mesh.triangles.size() != size_t{2} * (columns - 1) * (rows - 1)) return 0;
  const Vec3 &first = mesh.vertices.front(), size = mesh.vertices.back() - first;
  if (!(size.x() > 0 && size.z() > 0)) return 0;
  constexpr double kEven = 1e-3;  // of a step
  const double step_x = size.x() / (columns - 1), step_z = size.z() / (rows - 1);
  for (uint32_t row = 0; row < rows; ++row) {
    for (uint32_t column = 0; column < columns; ++column) {
      const uint32_t corner = row * columns + column;
      const Vec3 from_first = mesh.vertices[corner] - first;
      const bool is_even = std::abs(from_first.x() - column * step_x) <= kEven * step_x &&
                           std::abs(from_first.z() - row * step_z) <= kEven * step_z;
      if (!is_even) return 0;
      if (row + 1 == rows || column + 1 == columns) continue;
      const size_t cell = size_t{2} * (size_t{row} * (columns - 1) + column);
      const uint32_t below = corner + columns;
      if (mesh.triangles[cell] != Triangle{corner, below, corner + 1} ||
          mesh.triangles[cell + 1] != Triangle{corner + 1, below, below + 1}) {
        return 0;
      }
    }
  }
  return columns;
}

}  // namespace pilesim
