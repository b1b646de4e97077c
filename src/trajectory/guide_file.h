// guide.json, beside a trajectory of a pile that was held in a guide: counts of each frame, the
// guide, and where bodies are held. The whole format: these structs, and the names of their
// members.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "core/types.h"

namespace pilesim {

// At the end of a frame; the first is frame 1.
struct GuideFileFrame {
  double time_s = 0;
  uint32_t in_guide = 0;  // bodies that are controlled
  uint32_t passed = 0, filtered = 0, failed = 0;
  uint32_t held = 0;   // bodies that sleep or have a nail
  uint32_t nails = 0;  // that are in place
  uint64_t knocked_loose = 0;
  double height_m = 0;
  double mean_drift_m = 0, largest_drift_m = 0;
};

// Where bodies are held from a frame on.
struct GuideFileConstraints {
  uint64_t frame = 0;
  std::vector<Vec3> points;  // m, world; written to a tenth of a millimetre
};

struct GuideFile {
  std::vector<GuideFileFrame> frames;
  std::vector<Vec3> vertices;  // m, world, of the guide; written as points are; empty: no mesh
  std::vector<std::array<uint32_t, 3>> triangles;
  std::vector<GuideFileConstraints> constraints;  // in the order of frames
};

// Throws Error(io).
void write_guide_file(const std::filesystem::path& file, const GuideFile& guide);
// Throws Error(io), or Error(input) for a file of another format or version, and where a triangle
// names a vertex that is not there.
GuideFile read_guide_file(const std::filesystem::path& file);

}  // namespace pilesim
