// Rigid vertex-animation textures, which a vertex shader of a game engine plays: docs/export.md.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "export/export_file.h"
#include "export/export_job.h"
#include "export/export_source.h"

namespace pilesim {

// Sizes of the two pictures, in texels: a frame takes as few rows as possible, of at most 8192
// texels.
struct VatLayout {
  size_t columns = 0, rows = 0;  // per frame
  size_t height = 0;             // all frames together
  double frames_per_step = 1;    // of the trajectory, 1 / N with --every N
};

VatLayout vat_layout(size_t bodies, size_t frames);

struct VatFiles {
  ExportFile &mesh, &positions, &rotations, &about;
  std::vector<std::string> names;  // of these four
};

// Writes a GLB, two EXR pictures and a JSON file. Holds two copies of a picture in memory. Throws
// Error(usage) if it exceeds the limits of graphics cards or of glTF readers.
void write_vat(ExportSource& source, const ExportJob& job, const VatFiles& files);

}  // namespace pilesim
