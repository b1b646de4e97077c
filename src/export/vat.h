// Rigid vertex-animation textures, which game engines play by a vertex shader: docs/export.md.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "export/export_file.h"
#include "export/export_job.h"
#include "export/export_source.h"

namespace pilesim {

// Sizes of the two pictures, in texels: a frame takes as few rows as it can, of at most 8192
// texels.
struct VatLayout {
  size_t columns = 0, rows = 0;  // of a frame
  size_t height = 0;             // of all frames
  double frames_per_step = 1;    // of the trajectory, 1 / N with --every N
};

VatLayout vat_layout(size_t bodies, size_t frames);

struct VatFiles {
  ExportFile &mesh, &positions, &rotations, &about;
  std::vector<std::string> names;  // of these four
};

// A GLB, two EXR pictures and a JSON file. Holds one picture in memory, twice. Throws Error(usage)
// where graphics cards or readers of glTF would not take it.
void write_vat(ExportSource& source, const ExportJob& job, const VatFiles& files);

}  // namespace pilesim
