// Limits of a mesh, checked before a reader loads it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace pilesim {

inline constexpr uint64_t kMostFaces = 4'000'000;  // of a mesh file
// Readers cut polygons into triangles in a time that grows with the square of their corners: so
// much of it, in corners squared, for all polygons of more than four.
inline constexpr uint64_t kMostPolygonWork = 1'000'000'000;

// Counts the faces of a file as they come.
class FaceBudget {
 public:
  // Why the file is to be refused at a face of so many corners; empty: it is not.
  std::string take(uint64_t corners);

 private:
  uint64_t faces_ = 0, work_ = 0;
};

// Why the text of an OBJ file or the faces of an STL or PLY file, by the name's ending, are to be
// refused; empty for other files, and within the limits.
std::string fault_of_faces(const std::filesystem::path& file, std::string_view bytes);

}  // namespace pilesim
