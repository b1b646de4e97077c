// Accuracy and time of convex decompositions of meshes made solid; THICKNESS is that of sheets:
//   decomposition_benchmark PIECES VERTICES MESH[:THICKNESS]...
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "core/error.h"
#include "geometry/convex_decomposition.h"
#include "geometry/mesh_import.h"
#include "geometry/solid.h"

int main(int argc, char** argv) {
  using namespace pilesim;
  if (argc < 4) {
    std::fputs("decomposition_benchmark PIECES VERTICES MESH[:THICKNESS]...\n", stderr);
    return 2;
  }
  std::printf("%-16s %9s %7s %9s %9s %9s %14s %9s %8s\n", "mesh", "triangles", "pieces", "error %",
              "excess %", "missing %", "surface, max %", "mean %", "s");
  try {
    for (int i = 3; i < argc; ++i) {
      const std::string argument = argv[i];
      const size_t colon = argument.find(':');
      const std::string file = argument.substr(0, colon);
      const double thickness =
          colon == std::string::npos ? 0 : std::atof(argument.c_str() + colon + 1);
      const TriangleMesh mesh = make_solid(import_mesh(file), {.thickness_m = thickness}).mesh;
      const auto start = std::chrono::steady_clock::now();
      const Decomposition d = decompose(
          mesh, {.max_pieces = std::atoi(argv[1]), .max_piece_vertices = std::atoi(argv[2])},
          std::nullopt);
      const double seconds =
          std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
      const double diagonal = mesh.bounds().diagonal().norm();
      std::printf("%-16s %9zu %7zu %9.2f %9.2f %9.2f %14.2f %9.3f %8.1f\n",
                  std::filesystem::path(file).stem().c_str(), mesh.triangles.size(),
                  d.pieces.size(), 100 * d.volume_error(),
                  100 * d.excess_volume_m3 / d.mesh_volume_m3,
                  100 * d.missing_volume_m3 / d.mesh_volume_m3, 100 * d.surface_error_m / diagonal,
                  100 * d.mean_surface_error_m / diagonal, seconds);
    }
  } catch (const Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
