// Accuracy and time of convex decompositions:
//   decomposition_benchmark PIECES VERTICES MESH...
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>

#include "core/error.h"
#include "geometry/convex_decomposition.h"
#include "geometry/mesh_import.h"

int main(int argc, char** argv) {
  using namespace pilesim;
  if (argc < 4) {
    std::fputs("decomposition_benchmark PIECES VERTICES MESH...\n", stderr);
    return 2;
  }
  std::printf("%-16s %7s %9s %9s %9s %14s %9s %8s\n", "mesh", "pieces", "error %", "excess %",
              "missing %", "surface, max %", "mean %", "s");
  try {
    for (int i = 3; i < argc; ++i) {
      const TriangleMesh mesh = import_mesh(argv[i]);
      const auto start = std::chrono::steady_clock::now();
      const Decomposition d = decompose(
          mesh, {.max_pieces = std::atoi(argv[1]), .max_piece_vertices = std::atoi(argv[2])},
          std::nullopt);
      const double seconds =
          std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
      const double diagonal = mesh.bounds().diagonal().norm();
      std::printf("%-16s %7zu %9.2f %9.2f %9.2f %14.2f %9.3f %8.1f\n",
                  std::filesystem::path(argv[i]).stem().c_str(), d.pieces.size(),
                  100 * d.volume_error(), 100 * d.excess_volume_m3 / d.mesh_volume_m3,
                  100 * d.missing_volume_m3 / d.mesh_volume_m3, 100 * d.surface_error_m / diagonal,
                  100 * d.mean_surface_error_m / diagonal, seconds);
    }
  } catch (const Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
