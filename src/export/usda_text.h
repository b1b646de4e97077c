// Building blocks of USD's text form.
#pragma once

#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/parallel_for.h"
#include "export/export_file.h"
#include "export/export_source.h"

namespace pilesim {

// Unique names of prims: letters, digits and _.
class UsdaNames {
 public:
  std::string operator()(const std::string& name);

 private:
  std::set<std::string> taken_;
};

// Names of prims that bodies refer to, by shape and by look.
struct UsdaPrims {
  std::vector<std::string> mesh, look;
  // By look and picture number: materials of painted bodies with textured meshes.
  std::map<std::pair<uint32_t, size_t>, std::string> textured_look;
  // By shape: picture numbers of its triangles on painted bodies, 0: a colour. Each of several
  // pictures has a subset of the mesh; colours need none.
  std::vector<std::map<std::string, size_t>> subsets;

  // The material of a body with this shape and look.
  std::string binding(uint32_t shape, uint32_t look_index) const;
  // The same for the mesh's subsets, which are prims within it.
  std::string subset_bindings(uint32_t shape, uint32_t look_index, const std::string& indent) const;
  // The metadata that turn a prim into the mesh of a shape.
  std::string mesh_metadata(uint32_t shape, const std::string& indent) const;
};

std::string usda_string(const std::string& text);  // in quotes

void append_tuple(std::string& text, const Vec3f& v);

// "[a, b, ...]" with `count` values, each written by append(text, i).
template <class Append>
void write_list(ExportFile& file, size_t count, const Append& append) {
  constexpr size_t kGrain = 4096;  // values per thread at a time
  std::vector<std::string> parts((count + kGrain - 1) / kGrain);
  parallel_for(count, kGrain, [&](size_t begin, size_t end) {
    std::string& text = parts[begin / kGrain];
    for (size_t i = begin; i < end; ++i) {
      if (i > 0) text += ", ";
      append(text, i);
    }
  });
  file.write("[");
  for (const std::string& part : parts) file.write(part);
  file.write("]");
}

inline void write_line(ExportFile& file, const std::string& text) { file.write(text + '\n'); }

// A time code is a frame of the trajectory; `k` is a frame of the source.
std::string time_code(const ExportSource& source, size_t k);

// Where an attribute is written: its value in the scene, its declaration, or a clip's part of it.
enum class UsdaPlace : uint8_t { scene, declared, clip };

// Translation and rotation with their keys, in full accuracy, with quaternions of floats. Each
// attribute starts a line.
void append_pose(std::string& text, const ExportSource& source, const ExportTrack& track,
                 UsdaPlace place);
// For prims with these two operations.
inline constexpr char kXformOrder[] =
    "\n        uniform token[] xformOpOrder = [\"xformOp:translate\", \"xformOp:orient\"]";

}  // namespace pilesim
