// The bodies of a USD file, in one of two forms; usda.cpp writes the rest of the file.
#pragma once

#include <memory>
#include <vector>

#include "export/export_file.h"
#include "export/export_source.h"
#include "export/usda_text.h"

namespace pilesim {

// Frames of the source, both inclusive.
struct FrameSpan {
  size_t first = 0, last = 0;
};

class UsdaBodies {
 public:
  virtual ~UsdaBodies() = default;

  // Adds to each frame the number of poses written for it.
  virtual void count_poses(std::vector<uint64_t>& poses) const = 0;
  // Prims within /pile. `has_clips`: motion is only declared.
  virtual void write(ExportFile& file, bool has_clips) = 0;
  // The motion in these frames, for the same prims.
  virtual void write_clip(ExportFile& file, const FrameSpan& clip) = 0;
  // Declares all attributes that clips write.
  virtual void write_manifest(ExportFile& file) = 0;
};

// One Mesh per body that refers to its shape's, with keys if it moves.
std::unique_ptr<UsdaBodies> usda_objects(ExportSource& source, const UsdaPrims& prims);
// PointInstancers: one for bodies that never move, others by the time of their bodies' motion.
std::unique_ptr<UsdaBodies> usda_instancers(ExportSource& source, const UsdaPrims& prims);

}  // namespace pilesim
