// Words of USD's text form, which all parts of a file are written with.
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

// Names of prims: letters, digits and _, not the same twice.
class UsdaNames {
 public:
  std::string operator()(const std::string& name);

 private:
  std::set<std::string> taken_;
};

// Names of prims that bodies are made of, by shape and by look.
struct UsdaPrims {
  std::vector<std::string> mesh, look;
  // By look and number of the picture: materials of painted bodies whose meshes have textures.
  std::map<std::pair<uint32_t, size_t>, std::string> textured_look;
  // By shape: pictures that its triangles have where bodies are painted, 0: a colour. Several are
  // subsets of the mesh, but for what has a colour.
  std::vector<std::map<std::string, size_t>> subsets;

  // The material of a body of the shape with the look.
  std::string binding(uint32_t shape, uint32_t look_index) const;
  // The same of the mesh's subsets, prims within it.
  std::string subset_bindings(uint32_t shape, uint32_t look_index, const std::string& indent) const;
  // The metadata that make a prim the mesh of a shape.
  std::string mesh_metadata(uint32_t shape, const std::string& indent) const;
};

std::string usda_string(const std::string& text);  // in quotes

void append_tuple(std::string& text, const Vec3f& v);

// "[a, b, ...]" of `count` values, each of which append(text, i) writes.
template <class Append>
void write_list(ExportFile& file, size_t count, const Append& append) {
  constexpr size_t kGrain = 4096;  // values that one thread writes at a time
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

// A time code is a frame of the trajectory; `k` is one of the source.
std::string time_code(const ExportSource& source, size_t k);

// The place of an attribute: its value in the scene itself, its declaration, or a clip's part of
// it.
enum class UsdaPlace : uint8_t { scene, declared, clip };

// Translation and rotation with their keys: in full accuracy, quaternions of floats. Each attribute
// begins a line.
void append_pose(std::string& text, const ExportSource& source, const ExportTrack& track,
                 UsdaPlace place);
// For prims that have these two.
inline constexpr char kXformOrder[] =
    "\n        uniform token[] xformOpOrder = [\"xformOp:translate\", \"xformOp:orient\"]";

}  // namespace pilesim
